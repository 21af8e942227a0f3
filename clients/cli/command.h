/// Code shared by all verbs: arguments, error messages, connection to the server.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "api/flags/flags.h"
#include "clients/cli/cli.h"
#include "clients/cli/verb_text.h"
#include "core/base/result.h"

namespace cli {

using flags::above_zero;
using flags::edit_distance;
using flags::fault_of;
using flags::parse_and_run;
using flags::share_within;
using flags::within;

/// Prints "tessera VERB: message" to stderr, with the location before the message if there is one.
/// Returns kFailed.
int complain(const std::string& verb, const core::Error& error);

/// Address and key of the server: --server and --key, TESSERA_SERVER and TESSERA_KEY.
struct ServerFlags {
  std::string url = "http://127.0.0.1:8080";
  std::string key;
};
void add_server_flags(CLI::App& app, ServerFlags& flags);

}  // namespace cli
