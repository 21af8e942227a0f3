/// Shell completions and the manual page, as text. Pure functions of the verbs' options.
#pragma once

#include <span>
#include <string>

#include "clients/cli/verb_text.h"

namespace cli {

/// Scripts to source, or to install where the shell looks for completions of `tessera`.
std::string bash_completion(std::span<const VerbText> verbs);
std::string zsh_completion(std::span<const VerbText> verbs);
std::string fish_completion(std::span<const VerbText> verbs);

/// Returns tessera(1) in the macros of man(7).
std::string manual_page(std::span<const VerbText> verbs);

}  // namespace cli
