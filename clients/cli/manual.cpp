// The verbs that tell about the others: completion, man.
#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "clients/cli/command.h"
#include "clients/cli/completion.h"

namespace cli {
namespace {

using Writer = std::string (*)(std::span<const VerbText>);

constexpr std::array<std::pair<std::string_view, Writer>, 3> kShells = {{
    {"bash", &bash_completion},
    {"zsh", &zsh_completion},
    {"fish", &fish_completion},
}};

int print(const char* verb, Writer writer) {
  const auto verbs = describe_verbs();
  if (!verbs) {
    return complain(verb, verbs.error());
  }
  const std::string text = writer(*verbs);
  const bool written = std::fputs(text.c_str(), stdout) >= 0 && std::fflush(stdout) == 0;
  return written ? kDone : kFailed;
}

}  // namespace

int completion(const Args& args) {
  CLI::App app("Prints a script that completes commands, options, files and job ids in a shell.",
               "tessera completion");
  std::string shell;
  std::vector<std::string> names;
  std::string list;
  for (const auto& [name, writer] : kShells) {
    names.emplace_back(name);
    list += (list.empty() ? "" : ", ") + std::string(name);
  }
  app.add_option("shell", shell, "One of " + list)
      ->required()
      ->check(CLI::Validator(
          [names, list](const std::string& text) {
            const bool known = std::find(names.begin(), names.end(), text) != names.end();
            return known ? std::string() : "\"" + text + "\" is none of " + list;
          },
          ""))
      ->type_name("SHELL");
  const auto run = [&] {
    const auto* row = std::find_if(kShells.begin(), kShells.end(),
                                   [&](const auto& each) { return each.first == shell; });
    return print("completion", row->second);
  };
  return parse_and_run(app, args, run, [&] { return Choices{{"shell", names}}; });
}

int man(const Args& args) {
  CLI::App app("Prints the manual page: tessera man | man -l -", "tessera man");
  return parse_and_run(app, args, [] { return print("man", &manual_page); });
}

}  // namespace cli
