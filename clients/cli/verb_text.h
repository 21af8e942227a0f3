/// Texts of all verbs, for completions and the manual page: each verb describes itself
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
  std::vector<std::string> choices = {};  ///< empty: any value
};

struct VerbText {
  std::string name;
  std::string summary;  ///< a phrase, as in `tessera --help`
  std::string text;     ///< sentences
  std::vector<OptionText> operands;
  std::vector<OptionText> options;
  Choices choices;  ///< as reported by the verb
};

/// Parses the line of flags::describe(). Errors: kInvalidArgument.
core::Result<VerbText> read_verb_text(const Verb& verb, const std::string& json);

/// Sets the choices of every option and operand: those reported by its verb, and for options
/// otherwise those of the first verb that reports any. Client verbs have no registries and thus get
/// the renderer's.
void share_choices(std::span<VerbText> verbs);

/// Runs this program with --describe for each verb. Errors: those of starting it.
core::Result<std::vector<VerbText>> describe_verbs();

}  // namespace cli
