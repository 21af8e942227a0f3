/// The verb `check`: verifies a data directory that no server uses.
#pragma once

#include <span>
#include <string_view>

namespace server {

/// args: what follows the verb. The exit code of the process: 1 when something is damaged.
int check_command(std::span<const std::string_view> args);

}  // namespace server
