/// What all verbs do alike: read arguments, complain, find the server.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>

#include "clients/cli/cli.h"
#include "clients/cli/verb_text.h"
#include "core/base/result.h"

namespace cli {

/// Parses args with `app`, then calls body. --help prints to stdout and gives 0; --describe does
/// the same for programs (verb_text.h), with the choices; anything wrong is told on stderr and
/// gives 2.
int parse_and_run(CLI::App& app, const Args& args, const std::function<int()>& body,
                  const std::function<Choices()>& choices = {});

/// One sentence on what is wrong with the command, and on what may have been meant.
std::string fault_of(const CLI::App& app, const CLI::ParseError& error);

/// For numbers: "0 is outside [1, 64]", as the server says it. Both ends are allowed, but for 0 as
/// the lower end of `above_zero`.
CLI::Validator within(double min, double max);
CLI::Validator above_zero(double max);
/// For a share: "5%" stands for 0.05. Both ends are allowed.
CLI::Validator share_within(double min, double max);

/// "tessera VERB: message", with the place before it if there is one, on stderr. Returns kFailed.
int complain(const std::string& verb, const core::Error& error);

/// Insertions, deletions and replacements of one character that make a of b.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// Where the server is and how to be let in: --server and --key, TESSERA_SERVER and TESSERA_KEY.
struct ServerFlags {
  std::string url = "http://127.0.0.1:8080";
  std::string key;
};
void add_server_flags(CLI::App& app, ServerFlags& flags);

}  // namespace cli
