/// The command `check`: verifies a data directory while no server uses it.
#pragma once

#include <string>
#include <vector>

namespace server {

/// args: arguments of the command. Returns the exit code of the process: 1 when something is
/// damaged.
int check_command(const std::vector<std::string>& args);

}  // namespace server
