#include "clients/cli/completion.h"

#include <algorithm>
#include <string_view>

namespace cli {
namespace {

/// What may stand for a value.
enum class Kind { kSwitch, kText, kFile, kFolder, kJob, kExperiment };

Kind kind_of(const OptionText& option) {
  const std::string_view value = option.value;
  if (value.empty()) {
    return Kind::kSwitch;
  }
  if (value == "FILE" || value == "SCENE") {
    return Kind::kFile;
  }
  if (value == "DIR") {
    return Kind::kFolder;
  }
  if (value == "EXPERIMENT") {
    return Kind::kExperiment;
  }
  return value == "ID" || value == "ID..." ? Kind::kJob : Kind::kText;
}

// The newest jobs of the server; nothing where none answers.
constexpr std::string_view kJobIds = "tessera jobs --limit 50 2>/dev/null | awk 'NR > 1 {print $1}'";
constexpr std::string_view kExperiments = "tessera lab | awk '{print $1}'";

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

/// In single quotes, for a POSIX shell.
std::string shell_quoted(std::string_view text) { return "'" + replaced(text, "'", "'\\''") + "'"; }

std::string joined(const std::vector<std::string>& parts, std::string_view between) {
  std::string out;
  for (const std::string& part : parts) {
    out += (out.empty() ? "" : std::string(between)) + part;
  }
  return out;
}

std::string_view bash_kind(Kind kind) {
  switch (kind) {
    case Kind::kFile:
      return "file";
    case Kind::kFolder:
      return "folder";
    case Kind::kJob:
      return "job";
    case Kind::kExperiment:
      return "experiment";
    case Kind::kSwitch:
    case Kind::kText:
      break;
  }
  return "text";
}

std::string bash_verb(const VerbText& verb) {
  std::vector<std::string> names;
  std::string cases;
  for (const OptionText& option : verb.options) {
    names.insert(names.end(), option.names.begin(), option.names.end());
    if (!option.value.empty()) {
      cases += "        " + joined(option.names, "|") + ") kind=" + std::string(bash_kind(kind_of(option))) + " ;;\n";
    }
  }
  const std::string_view operand = verb.operands.empty() ? "none" : bash_kind(kind_of(verb.operands.front()));
  return "    " + verb.name + ")\n      options=" + shell_quoted(joined(names, " ")) +
         "\n      operand=" + std::string(operand) + "\n      case $before in\n" + cases + "      esac\n      ;;\n";
}

/// Brackets and colons have a meaning in zsh's specifications.
std::string zsh_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    out += c == '[' || c == ']' || c == ':' || c == '\\' ? std::string("\\") + c : std::string(1, c);
  }
  return out;
}

std::string zsh_action(Kind kind) {
  switch (kind) {
    case Kind::kFile:
      return "_files";
    case Kind::kFolder:
      return "_files -/";
    case Kind::kJob:
      return "_tessera_jobs";
    case Kind::kExperiment:
      return "_tessera_experiments";
    case Kind::kSwitch:
    case Kind::kText:
      break;
  }
  return " ";
}

std::string zsh_verb(const VerbText& verb) {
  std::string out = "    " + verb.name + ")\n      _arguments";
  for (const OptionText& option : verb.options) {
    const std::string value =
        option.value.empty() ? "" : ":" + zsh_text(option.value) + ":" + zsh_action(kind_of(option));
    const std::string others = option.repeats ? "*" : "(" + joined(option.names, " ") + ")";
    for (const std::string& name : option.names) {
      out += " \\\n        " + shell_quoted(others + name + "[" + zsh_text(option.text) + "]" + value);
    }
  }
  for (const OptionText& operand : verb.operands) {
    out += " \\\n        " + shell_quoted((operand.repeats ? "*:" : ":") + zsh_text(operand.value) + ":" +
                                 zsh_action(kind_of(operand)));
  }
  return out + "\n      ;;\n";
}

std::string fish_quoted(std::string_view text) {
  return "'" + replaced(replaced(text, "\\", "\\\\"), "'", "\\'") + "'";
}

std::string fish_value(Kind kind) {
  switch (kind) {
    case Kind::kFile:
      return " -r -F";
    case Kind::kFolder:
      return " -x -a '(__fish_complete_directories)'";
    case Kind::kJob:
      return " -x -a " + fish_quoted("(" + std::string(kJobIds) + ")");
    case Kind::kExperiment:
      return " -x -a " + fish_quoted("(" + std::string(kExperiments) + ")");
    case Kind::kText:
      return " -x";
    case Kind::kSwitch:
      break;
  }
  return "";
}

std::string fish_verb(const VerbText& verb) {
  const std::string head = "complete -c tessera -n " + fish_quoted("__fish_seen_subcommand_from " + verb.name);
  std::string out;
  for (const OptionText& option : verb.options) {
    std::string names;
    for (const std::string& name : option.names) {
      names += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
    }
    out += head + names + fish_value(kind_of(option)) + " -d " + fish_quoted(option.text) + "\n";
  }
  for (const OptionText& operand : verb.operands) {
    if (kind_of(operand) == Kind::kFile) {
      out += head + " -F\n";
    } else if (kind_of(operand) == Kind::kJob || kind_of(operand) == Kind::kExperiment) {
      out += head + fish_value(kind_of(operand)) + "\n";
    }
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
         "  local options= operand=none kind=\n"
         "  COMPREPLY=()\n"
         "  if ((COMP_CWORD == 1)); then\n"
         "    mapfile -t COMPREPLY < <(compgen -W " + shell_quoted(names + "--help --version") + " -- \"$word\")\n"
         "    return\n"
         "  fi\n"
         "  # bash takes --name=value apart at the sign.\n"
         "  if [[ $word == = ]]; then\n"
         "    word=\n"
         "  elif [[ $before == = ]]; then\n"
         "    before=${COMP_WORDS[COMP_CWORD-2]}\n"
         "  fi\n"
         "  case ${COMP_WORDS[1]} in\n" + cases +
         "  esac\n"
         "  if [[ -z $kind && $word == -* ]]; then\n"
         "    mapfile -t COMPREPLY < <(compgen -W \"$options\" -- \"$word\")\n"
         "    return\n"
         "  fi\n"
         "  case ${kind:-$operand} in\n"
         "    file)\n"
         "      compopt -o filenames 2>/dev/null\n"
         "      mapfile -t COMPREPLY < <(compgen -f -- \"$word\")\n"
         "      ;;\n"
         "    folder)\n"
         "      compopt -o filenames 2>/dev/null\n"
         "      mapfile -t COMPREPLY < <(compgen -d -- \"$word\")\n"
         "      ;;\n"
         "    job) mapfile -t COMPREPLY < <(compgen -W \"latest $(" + std::string(kJobIds) + ")\" -- \"$word\") ;;\n"
         "    experiment) mapfile -t COMPREPLY < <(compgen -W \"$(" + std::string(kExperiments) + ")\" -- \"$word\") ;;\n"
         "    none) mapfile -t COMPREPLY < <(compgen -W \"$options\" -- \"$word\") ;;\n"
         "  esac\n"
         "}\n"
         "complete -F _tessera tessera\n";
}

std::string zsh_completion(std::span<const VerbText> verbs) {
  std::string names;
  std::string cases;
  for (const VerbText& verb : verbs) {
    names += "    " + shell_quoted(verb.name + ":" + zsh_text(verb.summary)) + "\n";
    cases += zsh_verb(verb);
  }
  return "#compdef tessera\n"
         "# Completion of tessera for zsh: source <(tessera completion zsh)\n"
         "_tessera_jobs() {\n"
         "  compadd latest ${(f)\"$(" + std::string(kJobIds) + ")\"}\n"
         "}\n"
         "_tessera_experiments() {\n"
         "  compadd ${(f)\"$(" + std::string(kExperiments) + ")\"}\n"
         "}\n"
         "_tessera() {\n"
         "  local -a verbs=(\n" + names +
         "  )\n"
         "  if ((CURRENT == 2)); then\n"
         "    _describe verb verbs\n"
         "    return\n"
         "  fi\n"
         "  local verb=$words[2]\n"
         "  shift words\n"
         "  ((CURRENT--))\n"
         "  case $verb in\n" + cases +
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
      "complete -c tessera -n __fish_use_subcommand -l help -d 'what there is'\n"
      "complete -c tessera -n __fish_use_subcommand -l version -d 'which one this is'\n";
  for (const VerbText& verb : verbs) {
    out += "complete -c tessera -n __fish_use_subcommand -a " + verb.name + " -d " + fish_quoted(verb.summary) + "\n";
    out += fish_verb(verb);
  }
  return out;
}

}  // namespace cli
