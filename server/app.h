/// Runs the server: builds every object, passes it down, runs until a signal stops it.
#pragma once

#include <functional>
#include <span>
#include <string_view>

#include "server/config/config.h"

namespace server {

/// Serves until SIGTERM or SIGINT. The first line on stdout is `listening on http://HOST:PORT`.
/// Returns the exit code: 0 after a graceful stop, 1 when it could not start (the reason is on
/// stderr). read_again: reads the configuration again, on SIGHUP. Its keys, host names, proxies,
/// log level and certificates apply from the next connection on; the log names other changes, which
/// need a restart. On a terminal SIGHUP ends the process as usual.
int serve(const Config& config, const std::function<core::Result<Config>()>& read_again);

/// The command `serve`; args are its arguments. Prints the help for --help; returns 2 for wrong
/// usage.
int serve_command(std::span<const std::string_view> args);

}  // namespace server
