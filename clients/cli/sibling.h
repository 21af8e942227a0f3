/// The program tessera-server next to this one.
#pragma once

namespace cli {

/// Executes it in place of this program, with these arguments; returns kFailed if it cannot.
int execute_sibling(char** argv);

}  // namespace cli
