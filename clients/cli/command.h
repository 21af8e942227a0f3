/// What all verbs do alike: read arguments, complain, find the server.
#pragma once

#include <string>
#include <string_view>

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

/// "tessera VERB: message", with the place before it if there is one, on stderr. Returns kFailed.
int complain(const std::string& verb, const core::Error& error);

/// Where the server is and how to be let in: --server and --key, TESSERA_SERVER and TESSERA_KEY.
struct ServerFlags {
  std::string url = "http://127.0.0.1:8080";
  std::string key;
};
void add_server_flags(CLI::App& app, ServerFlags& flags);

}  // namespace cli
