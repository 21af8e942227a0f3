/// The end of a program's output.
#pragma once

namespace cli {

/// Writes what is left of the standard output. Returns `code`, or kFailed with a message if
/// anything of the output could not be written: a full disk, a closed descriptor.
int checked_output(const char* program, int code);

}  // namespace cli
