/// The server as one call: builds every object, hands it down, runs until it is told to stop.
#pragma once

#include <functional>
#include <span>
#include <string_view>

#include "server/config.h"

namespace server {

/// Serves until SIGTERM or SIGINT. The first line on stdout is `listening on http://HOST:PORT`.
/// Returns the exit code: 0 after a graceful stop, 1 when it could not start (the reason is on
/// stderr). read_again: the configuration anew, for SIGHUP. Then the keys, names, proxies, level of
/// the log and certificates that it names are in force from the next connection on; the log tells
/// what else has changed and needs a restart. On a terminal SIGHUP ends the process, as ever.
int serve(const Config& config, const std::function<core::Result<Config>()>& read_again);

/// The verb `serve`: args are what follows it. Prints the help for --help; 2 for wrong usage.
int serve_command(std::span<const std::string_view> args);

}  // namespace server
