/// The server as one call: builds every object, hands it down, runs until it is told to stop.
#pragma once

#include <span>
#include <string_view>

#include "server/config.h"

namespace server {

/// Serves until SIGTERM or SIGINT. The first line on stdout is `listening on http://HOST:PORT`.
/// Returns the exit code: 0 after a graceful stop, 1 when it could not start (the reason is on
/// stderr).
int serve(const Config& config);

/// The verb `serve`: args are what follows it. Prints the help for --help; 2 for wrong usage.
int serve_command(std::span<const std::string_view> args);

}  // namespace server
