/// The verb `backup`: copies a data directory, also while a server uses it.
#pragma once

#include <string>
#include <vector>

namespace server {

/// args: what follows the verb. The exit code of the process.
int backup_command(const std::vector<std::string>& args);

}  // namespace server
