/// The texts of all verbs, for completions and the manual page: each verb describes itself
/// (flags::describe()).
#pragma once

#include <span>
#include <string>
#include <vector>

#include "api/flags/flags.h"
#include "clients/cli/cli.h"
#include "core/base/result.h"

namespace cli {

using flags::Choices;
using flags::describe;
using flags::kDescribe;
using flags::names_of;

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

/// Reads the line of flags::describe(). Errors: kInvalidArgument.
core::Result<VerbText> read_verb_text(const Verb& verb, const std::string& json);

/// Gives every option and operand its choices: those that its verb tells, else those of the first
/// verb that tells any. Client verbs, which have no registries, so get what the renderer says.
void share_choices(std::span<VerbText> verbs);

/// Asks this very program about each of its verbs. Errors: those of starting it.
core::Result<std::vector<VerbText>> describe_verbs();

}  // namespace cli
