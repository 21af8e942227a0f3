/// The verb `check`: verifies a data directory that no server uses.
#pragma once

#include <string>
#include <vector>

namespace server {

/// args: what follows the verb. The exit code of the process: 1 when something is damaged.
int check_command(const std::vector<std::string>& args);

}  // namespace server
