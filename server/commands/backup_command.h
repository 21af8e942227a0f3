/// The command `backup`: copies a data directory, even while a server uses it.
#pragma once

#include <string>
#include <vector>

namespace server {

/// args: arguments of the command. Returns the exit code of the process.
int backup_command(const std::vector<std::string>& args);

}  // namespace server
