/// The command `keys`: adds, lists and removes the bearer keys of a data directory, even while a
/// server uses it.
#pragma once

#include <string>
#include <vector>

namespace server {

/// args: arguments of the command. Returns the exit code of the process.
int keys_command(const std::vector<std::string>& args);

}  // namespace server
