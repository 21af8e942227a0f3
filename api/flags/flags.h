/// Command-line flags as every verb reads them, of the server and of the clients: checks of values,
/// one sentence on a fault, and a description for programs.
///
/// Every verb answers `tessera VERB --describe` with one line of JSON:
/// {"text", "operands": [option...], "options": [option...], "choices"}, an option being
/// {"names": ["-o", "--output"], "value": "FILE", "text", "variable", "preset", "repeats"}.
/// "choices", {"--sampler": ["sobol", ...]}: the values of closed sets by the long name of the
/// option, which may be another verb's, or by the operand. `value` is empty for a switch,
/// `variable` (of the environment) and `preset` where there is none. An operand has one name.
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

namespace flags {

inline constexpr std::string_view kDescribe = "--describe";

/// Values of closed sets: by the name of an option with its dashes, or of an operand.
using Choices = std::map<std::string, std::vector<std::string>>;

/// The names of a registry's rows.
template <typename Rows>
std::vector<std::string> names_of(const Rows& rows) {
  std::vector<std::string> names;
  for (const auto& row : rows) {
    names.emplace_back(row.name);
  }
  return names;
}

/// Parses args, without program and verb, with `app`, whose name has both, then calls body. --help
/// prints to stdout and gives 0; --describe does the same for programs, with the choices; anything
/// wrong is told on stderr and gives 2.
int parse_and_run(CLI::App& app, const std::vector<std::string>& args,
                  const std::function<int()>& body, const std::function<Choices()>& choices = {});

/// The line of JSON for an app.
nlohmann::ordered_json describe(const CLI::App& app, const Choices& choices = {});

/// One sentence on what is wrong with the command, and on what may have been meant.
std::string fault_of(const CLI::App& app, const CLI::ParseError& error);

/// For numbers: "0 is outside [1, 64]", as the server says it. Both ends are allowed, but for 0 as
/// the lower end of `above_zero`.
CLI::Validator within(double min, double max);
CLI::Validator above_zero(double max);
/// For a share: "5%" stands for 0.05. Both ends are allowed; a share above 1 has to be written with
/// a percent sign, because 5 is likely to mean 5%.
CLI::Validator share_within(double min, double max);

/// Insertions, deletions and replacements of one character that make a of b.
std::size_t edit_distance(std::string_view a, std::string_view b);

}  // namespace flags
