/// What each verb takes, as data: completions and the manual page are made from it.
///
/// Every verb answers `tessera VERB --describe` with one line of JSON:
/// {"summary", "operands": [option...], "options": [option...]}, an option being
/// {"names": ["-o", "--output"], "value": "FILE", "text", "variable", "preset", "repeats"}.
/// `value` is empty for a switch, `variable` (of the environment) and `preset` where there is none;
/// the one name of an operand is its own.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "clients/cli/cli.h"
#include "core/base/result.h"

namespace cli {

inline constexpr std::string_view kDescribe = "--describe";

struct OptionText {
  std::vector<std::string> names;
  std::string value;
  std::string text;
  std::string variable;
  std::string preset;
  bool repeats = false;
};

struct VerbText {
  std::string name;
  std::string summary;  ///< a phrase, as in `tessera --help`
  std::string text;     ///< sentences
  std::vector<OptionText> operands;
  std::vector<OptionText> options;
};

/// The line of JSON for an app.
nlohmann::ordered_json describe(const CLI::App& app);

/// Reads such a line. Errors: kInvalidArgument.
core::Result<VerbText> read_verb_text(const Verb& verb, const std::string& json);

/// Asks this very program about each of its verbs. Errors: those of starting it.
core::Result<std::vector<VerbText>> describe_verbs();

}  // namespace cli
