/// The verb `keys`: adds, lists and removes the bearer keys of a data directory, while a server
/// runs on it or not.
#pragma once

#include <span>
#include <string_view>

namespace server {

/// args: what follows the verb. The exit code of the process.
int keys_command(std::span<const std::string_view> args);

}  // namespace server
