#include "clients/cli/completion.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "core/base/text.h"

namespace cli {
namespace {

using core::joined;

/// Words printed by a command, one per line, when they are needed.
struct Words {
  std::string_view kind;  ///< name in the scripts
  std::string_view command;
};

// The newest jobs of the server; only "latest" if no server answers.
constexpr Words kJobs = {
    "job", "echo latest; tessera jobs --limit 50 2>/dev/null | awk 'NR > 1 {print $1}'"};
constexpr Words kScenes = {"scene", "tessera render --scenes | awk '{print $1}'"};
constexpr Words kExperiments = {"experiment", "tessera lab | awk '{print $1}'"};
constexpr std::array kAllWords = {&kJobs, &kScenes, &kExperiments};

/// Completions offered for a value: words, files, folders, or none.
struct Offer {
  std::string_view value;
  const Words* words = nullptr;
  bool files = false;
  bool folders = false;
  const std::vector<std::string>* choices = nullptr;  ///< words of a closed set
};
constexpr std::array kOffers = {
    Offer{.value = "FILE", .files = true},
    Offer{.value = "FILE...", .files = true},
    Offer{.value = "DIR", .folders = true},
    Offer{.value = "SCENE", .words = &kScenes, .files = true},
    Offer{.value = "EXPERIMENT", .words = &kExperiments},
    Offer{.value = "ID", .words = &kJobs},
    Offer{.value = "ID...", .words = &kJobs},
    Offer{.value = "ID|FILE", .words = &kJobs, .files = true},
    Offer{.value = "ID|FILE...", .words = &kJobs, .files = true},
};

std::string replaced(std::string_view text, std::string_view what, std::string_view with) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    if (text.substr(at, what.size()) == what) {
      out += with;
      at += what.size();
    } else {
      out += text[at++];
    }
  }
  return out;
}

/// Returns the text in single quotes, for a POSIX shell.
std::string shell_quoted(std::string_view text) { return "'" + replaced(text, "'", "'\\''") + "'"; }

Offer offer_for(const OptionText& option) {
  if (!option.choices.empty()) {
    return Offer{.value = option.value, .choices = &option.choices};
  }
  const auto found = std::find_if(kOffers.begin(), kOffers.end(),
                                  [&](const Offer& o) { return o.value == option.value; });
  return found == kOffers.end() ? Offer{.value = option.value} : *found;
}

/// Returns "text", "folder", "file", "choice", a kind of words, or "file job".
std::string bash_kinds(const Offer& offer) {
  std::vector<std::string> kinds;
  if (offer.files) {
    kinds.emplace_back("file");
  }
  if (offer.folders) {
    kinds.emplace_back("folder");
  }
  if (offer.words != nullptr) {
    kinds.emplace_back(offer.words->kind);
  }
  if (offer.choices != nullptr) {
    kinds.emplace_back("choice");
  }
  return kinds.empty() ? "text" : joined(kinds, " ");
}

std::string bash_verb(const VerbText& verb) {
  std::vector<std::string> names;
  std::string cases;
  for (const OptionText& option : verb.options) {
    names.insert(names.end(), option.names.begin(), option.names.end());
    if (!option.value.empty()) {
      const Offer offer = offer_for(option);
      cases +=
          "        " + joined(option.names, "|") + ") kinds='" + bash_kinds(offer) + "'" +
          (offer.choices == nullptr ? ""
                                    : " choices=" + shell_quoted(joined(*offer.choices, " "))) +
          " ;;\n";
    }
  }
  const Offer offer = verb.operands.empty() ? Offer() : offer_for(verb.operands.front());
  const std::string operand = verb.operands.empty() ? "none" : bash_kinds(offer);
  return "    " + verb.name + ")\n      options=" + shell_quoted(joined(names, " ")) +
         "\n      operand='" + operand +
         "' choices=" + shell_quoted(offer.choices == nullptr ? "" : joined(*offer.choices, " ")) +
         "\n      case $before in\n" + cases + "      esac\n      ;;\n";
}

/// Escapes brackets and colons, which are special in zsh's specifications.
std::string zsh_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    out +=
        c == '[' || c == ']' || c == ':' || c == '\\' ? std::string("\\") + c : std::string(1, c);
  }
  return out;
}

std::string zsh_action(const Offer& offer) {
  if (offer.choices != nullptr) {
    return "(" + joined(*offer.choices, " ") + ")";
  }
  if (offer.words != nullptr) {
    return "_tessera_" + std::string(offer.words->kind) + (offer.files ? "_or_file" : "");
  }
  return offer.files ? "_files" : offer.folders ? "_files -/" : " ";
}

/// Returns functions that offer words, alone and together with files.
std::string zsh_words(const Words& words) {
  const std::string kind(words.kind);
  return "_tessera_" + kind + "() {\n  compadd ${(f)\"$(" + std::string(words.command) +
         ")\"}\n}\n" + "_tessera_" + kind + "_or_file() {\n  _alternative '" + kind + ":" + kind +
         ":_tessera_" + kind + "' 'files:file:_files'\n}\n";
}

std::string zsh_verb(const VerbText& verb) {
  std::string out = "    " + verb.name + ")\n      _arguments";
  for (const OptionText& option : verb.options) {
    const std::string value =
        option.value.empty() ? ""
                             : ":" + zsh_text(option.value) + ":" + zsh_action(offer_for(option));
    const std::string others = option.repeats ? "*" : "(" + joined(option.names, " ") + ")";
    for (const std::string& name : option.names) {
      out +=
          " \\\n        " + shell_quoted(others + name + "[" + zsh_text(option.text) + "]" + value);
    }
  }
  for (const OptionText& operand : verb.operands) {
    out += " \\\n        " + shell_quoted((operand.repeats ? "*:" : ":") + zsh_text(operand.value) +
                                          ":" + zsh_action(offer_for(operand)));
  }
  return out + "\n      ;;\n";
}

std::string fish_quoted(std::string_view text) {
  return "'" + replaced(replaced(text, "\\", "\\\\"), "'", "\\'") + "'";
}

std::string fish_value(const Offer& offer) {
  if (offer.value.empty()) {
    return "";
  }
  if (offer.folders) {
    return " -x -a '(__fish_complete_directories)'";
  }
  if (offer.choices != nullptr) {
    return " -x -a " + fish_quoted(joined(*offer.choices, " "));
  }
  const std::string words =
      offer.words == nullptr ? ""
                             : " -a " + fish_quoted("(" + std::string(offer.words->command) + ")");
  return (offer.files ? " -r -F" : " -x") + words;
}

std::string fish_verb(const VerbText& verb) {
  const std::string head =
      "complete -c tessera -n " + fish_quoted("__fish_seen_subcommand_from " + verb.name);
  std::string out;
  for (const OptionText& option : verb.options) {
    std::string names;
    for (const std::string& name : option.names) {
      names += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
    }
    out += head + names + fish_value(offer_for(option)) + " -d " + fish_quoted(option.text) + "\n";
  }
  for (const OptionText& operand : verb.operands) {
    const Offer offer = offer_for(operand);
    if (offer.files && offer.words == nullptr) {
      out += head + " -F\n";
    } else if (offer.words != nullptr || offer.choices != nullptr) {
      out += head + fish_value(offer) + "\n";
    }
  }
  return out;
}

/// Returns the cases for each kind of words.
std::string bash_words() {
  std::string out;
  for (const Words* words : kAllWords) {
    out += "      " + std::string(words->kind) +
           ")\n        mapfile -t -O ${#COMPREPLY[@]} COMPREPLY < <(compgen -W \"$(" +
           std::string(words->command) + ")\" -- \"$word\")\n        ;;\n";
  }
  return out;
}

}  // namespace

std::string bash_completion(std::span<const VerbText> verbs) {
  std::string names;
  std::string cases;
  for (const VerbText& verb : verbs) {
    names += verb.name + " ";
    cases += bash_verb(verb);
  }
  return "# Completion of tessera for bash: source <(tessera completion bash)\n"
         "_tessera() {\n"
         "  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]}\n"
         "  local options= operand=none kinds= kind= choices=\n"
         "  COMPREPLY=()\n"
         "  if ((COMP_CWORD == 1)); then\n"
         "    mapfile -t COMPREPLY < <(compgen -W " +
         shell_quoted(names + "--help --version") +
         " -- \"$word\")\n"
         "    return\n"
         "  fi\n"
         "  # bash takes --name=value apart at the sign.\n"
         "  if [[ $word == = ]]; then\n"
         "    word=\n"
         "  elif [[ $before == = ]]; then\n"
         "    before=${COMP_WORDS[COMP_CWORD-2]}\n"
         "  fi\n"
         "  case ${COMP_WORDS[1]} in\n" +
         cases +
         "  esac\n"
         "  if [[ -z $kinds && $word == -* ]]; then\n"
         "    mapfile -t COMPREPLY < <(compgen -W \"$options\" -- \"$word\")\n"
         "    return\n"
         "  fi\n"
         "  for kind in ${kinds:-$operand}; do\n"
         "    case $kind in\n"
         "      file)\n"
         "        compopt -o filenames 2>/dev/null\n"
         "        mapfile -t -O ${#COMPREPLY[@]} COMPREPLY < <(compgen -f -- \"$word\")\n"
         "        ;;\n"
         "      folder)\n"
         "        compopt -o filenames 2>/dev/null\n"
         "        mapfile -t COMPREPLY < <(compgen -d -- \"$word\")\n"
         "        ;;\n" +
         bash_words() +
         "      choice) mapfile -t COMPREPLY < <(compgen -W \"$choices\" -- \"$word\") ;;\n"
         "      none) mapfile -t COMPREPLY < <(compgen -W \"$options\" -- \"$word\") ;;\n"
         "    esac\n"
         "  done\n"
         "}\n"
         "complete -F _tessera tessera\n";
}

std::string zsh_completion(std::span<const VerbText> verbs) {
  std::string functions;
  for (const Words* words : kAllWords) {
    functions += zsh_words(*words);
  }
  std::string names;
  std::string cases;
  for (const VerbText& verb : verbs) {
    names += "    " + shell_quoted(verb.name + ":" + zsh_text(verb.summary)) + "\n";
    cases += zsh_verb(verb);
  }
  return "#compdef tessera\n"
         "# Completion of tessera for zsh: source <(tessera completion zsh)\n" +
         functions +
         "_tessera() {\n"
         "  local -a verbs=(\n" +
         names +
         "  )\n"
         "  if ((CURRENT == 2)); then\n"
         "    _describe verb verbs\n"
         "    return\n"
         "  fi\n"
         "  local verb=$words[2]\n"
         "  shift words\n"
         "  ((CURRENT--))\n"
         "  case $verb in\n" +
         cases +
         "  esac\n"
         "}\n"
         "if [[ $funcstack[1] == _tessera ]]; then\n"
         "  _tessera \"$@\"\n"
         "else\n"
         "  compdef _tessera tessera\n"
         "fi\n";
}

std::string fish_completion(std::span<const VerbText> verbs) {
  std::string out =
      "# Completion of tessera for fish: tessera completion fish | source\n"
      "complete -c tessera -f\n"
      "complete -c tessera -n __fish_use_subcommand -l help -d 'list the verbs'\n"
      "complete -c tessera -n __fish_use_subcommand -l version -d 'print the version'\n";
  for (const VerbText& verb : verbs) {
    out += "complete -c tessera -n __fish_use_subcommand -a " + verb.name + " -d " +
           fish_quoted(verb.summary) + "\n";
    out += fish_verb(verb);
  }
  return out;
}

}  // namespace cli
