/// The verb `keys`: adds, lists and removes the bearer keys of a data directory, while a server
/// runs on it or not.
#pragma once

#include <string>
#include <vector>

namespace server {

/// args: what follows the verb. The exit code of the process.
int keys_command(const std::vector<std::string>& args);

}  // namespace server
