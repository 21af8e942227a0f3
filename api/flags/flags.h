/// Command-line flags of every verb, of the server and of the clients: checks of values,
/// one-sentence messages for faults, and a machine-readable description.
///
/// Every verb answers `tessera VERB --describe` with one line of JSON:
/// {"text", "operands": [option...], "options": [option...], "choices"}, an option being
/// {"names": ["-o", "--output"], "value": "FILE", "text", "variable", "preset", "repeats"}.
/// "choices", {"--sampler": ["sobol", ...]}, lists the values of closed sets by the option's long
/// name, which may belong to another verb, or by the operand. `value` is empty for a switch;
/// `variable` (of the environment) and `preset` are empty if there is none. An operand has one
/// name.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "api/flags/exit_codes.h"
#include "core/base/result.h"

namespace flags {

inline constexpr std::string_view kDescribe = "--describe";

/// Values of closed sets, by the name of an option with its dashes, or of an operand.
using Choices = std::map<std::string, std::vector<std::string>>;

/// Returns the names of a registry's rows.
template <typename Rows>
std::vector<std::string> names_of(const Rows& rows) {
  std::vector<std::string> names;
  for (const auto& row : rows) {
    names.emplace_back(row.name);
  }
  return names;
}

/// Parses args (without program and verb) with `app`, whose name contains both, then calls body.
/// --help prints to stdout and returns 0; --describe prints JSON with the choices and returns 0;
/// faults are printed to stderr and return 2.
int parse_and_run(CLI::App& app, const std::vector<std::string>& args,
                  const std::function<int()>& body, const std::function<Choices()>& choices = {});

/// Prints "tessera backup: where: message" to stderr and returns code.
int complain(const char* program, const core::Error& error, int code);

/// Returns the line of JSON for an app.
nlohmann::ordered_json describe(const CLI::App& app, const Choices& choices = {});

/// Returns one sentence: what is wrong with the command, and a likely correction.
std::string fault_of(const CLI::App& app, const CLI::ParseError& error);

/// Checks a number: "0 is outside [1, 64]", as the server reports it. Both ends are allowed, except
/// 0 as the lower end of `above_zero`.
CLI::Validator within(double min, double max);
CLI::Validator above_zero(double max);
/// Checks a share: "5%" means 0.05. Both ends are allowed; a share above 1 needs a percent sign,
/// because 5 probably means 5%.
CLI::Validator share_within(double min, double max);

/// Removes blanks around an access key, such as the line break of the file that a secret was made
/// from, and refuses keys that no header can hold.
CLI::Validator key_text();

/// Returns the number of insertions, deletions and replacements of one character that turn b into
/// a.
std::size_t edit_distance(std::string_view a, std::string_view b);

}  // namespace flags
