/// The command `backup`: copies a data directory, even while a server uses it.
#pragma once

#include <string>
#include <vector>

#include "core/base/result.h"

namespace server {

struct BackedUp {
  int jobs = 0;
  int films = 0;
  std::vector<std::string> damages = {};  ///< of films, which are copied nevertheless
};
/// Copies the data directory `from` to `to`, which must be empty or not exist.
core::Result<BackedUp> back_up(const std::string& from, const std::string& to);

/// args: arguments of the command. Returns the exit code of the process.
int backup_command(const std::vector<std::string>& args);

}  // namespace server
