/// What each verb takes, as data: completions and the manual page are made from it.
///
/// Every verb answers `tessera VERB --describe` with one line of JSON:
/// {"summary", "operands": [option...], "options": [option...]}, an option being
/// {"names": ["-o", "--output"], "value": "FILE", "text", "variable", "preset", "repeats"}.
/// and "choices", {"--sampler": ["sobol", ...]}: the values of closed sets by the option's long
/// name or the operand's, also for options that other verbs have. `value` is empty for a switch,
/// `variable` (of the environment) and `preset` where there is none; the one name of an operand is
/// its own.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "clients/cli/cli.h"
#include "core/base/result.h"

namespace cli {

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

struct OptionText {
  std::vector<std::string> names;
  std::string value;
  std::string text;
  std::string variable;
  std::string preset;
  bool repeats = false;
  std::vector<std::string> choices = {};  ///< empty: anything
};

struct VerbText {
  std::string name;
  std::string summary;  ///< a phrase, as in `tessera --help`
  std::string text;     ///< sentences
  std::vector<OptionText> operands;
  std::vector<OptionText> options;
  Choices choices;  ///< as the verb tells them
};

/// The line of JSON for an app.
nlohmann::ordered_json describe(const CLI::App& app, const Choices& choices = {});

/// Reads such a line. Errors: kInvalidArgument.
core::Result<VerbText> read_verb_text(const Verb& verb, const std::string& json);

/// Gives every option and operand its choices: those that its verb tells, else those of the first
/// verb that tells any. Client verbs, which have no registries, so get what the renderer says.
void share_choices(std::span<VerbText> verbs);

/// Asks this very program about each of its verbs. Errors: those of starting it.
core::Result<std::vector<VerbText>> describe_verbs();

}  // namespace cli
