/// The verb `backup`: copies a data directory, also while a server uses it.
#pragma once

#include <span>
#include <string_view>

namespace server {

/// args: what follows the verb. The exit code of the process.
int backup_command(std::span<const std::string_view> args);

}  // namespace server
