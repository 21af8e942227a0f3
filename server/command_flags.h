/// Flags of the small verbs: `--name value`, switches, and words; from one table of them.
#pragma once

#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"

namespace server {

struct CommandFlag {
  std::string_view name;   ///< Without dashes.
  std::string_view value;  ///< What stands for the value in the help; empty: a switch.
  std::string_view text;
};

/// A verb as its help, completions and the manual page show it.
struct CommandText {
  std::string_view text;     ///< Sentences on what it does.
  std::string_view operand;  ///< What its words are; empty: it takes none.
  std::string_view operand_text;
  std::span<const CommandFlag> flags;
  std::span<const std::string_view> operand_choices =
      {};  ///< The first word is one of these; empty: anything.
};

struct CommandFlags {
  std::map<std::string, std::string> values;
  std::set<std::string> switches;
  std::vector<std::string> words;
};

/// Errors: kInvalidArgument with the flag as `where`. --help and --describe are always known.
core::Result<CommandFlags> parse_command_flags(std::span<const std::string_view> args,
                                               std::span<const CommandFlag> known);

/// Prints what --help or --describe ask for; false when neither was given.
bool print_command_text(const CommandFlags& flags, const CommandText& text);

/// --data, or where `tessera serve` would look.
core::Result<std::string> data_directory(const CommandFlags& flags);

}  // namespace server
