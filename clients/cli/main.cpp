// tessera: the client verbs. `serve`, `render` and `lab` belong to the program tessera-server next
// to it, which is executed in place of this one: client verbs start without loading the libraries
// of the renderer and OpenImageIO.
#include <algorithm>
#include <array>
#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <string_view>

#include "clients/cli/cli.h"
#include "clients/cli/command.h"
#include "clients/cli/output.h"
#include "clients/cli/shown.h"
#include "clients/cli/sibling.h"

namespace cli {
namespace {

std::string help_text() {
  std::string text =
      "tessera: renders glTF scenes and reports the error of every image\n\nUsage: tessera VERB "
      "...\n\n";
  for (const Verb& verb : verbs()) {
    std::string name(verb.name);
    name.resize(12, ' ');
    text += "  " + name + std::string(verb.summary) + "\n";
  }
  return text +
         "\n`tessera VERB --help` lists a verb's options. Exit codes: 0 success, 1 failure, 2 "
         "wrong usage.\n";
}

int unknown_verb(const std::string& name) {
  const auto known = verbs();
  const auto near = std::min_element(known.begin(), known.end(), [&](const Verb& a, const Verb& b) {
    return edit_distance(name, a.name) < edit_distance(name, b.name);
  });
  constexpr std::size_t kTypos = 2;
  const bool alike = edit_distance(name, near->name) <= std::min(kTypos, near->name.size() - 1);
  const std::string meant = alike ? "; did you mean " + std::string(near->name) + "?" : ".";
  std::fprintf(stderr, "tessera: unknown command \"%s\"%s `tessera --help` lists the commands.\n",
               shown(name).c_str(), meant.c_str());
  return kWrongUsage;
}

int dispatch(int argc, char** argv) {
  const std::string_view name = argc > 1 ? argv[1] : "";
  std::string help = "--help";
  if (name == "help" && argc > 2) {
    std::array<char*, 4> of_verb = {argv[0], argv[2], help.data(), nullptr};
    return dispatch(3, of_verb.data());
  }
  if (name == "--help" || name == "-h" || name == "help") {
    std::fputs(help_text().c_str(), stdout);
    return kDone;
  }
  if (name == "--version") {
    std::puts("tessera " TESSERA_VERSION);
    return kDone;
  }
  const auto known = verbs();
  const auto verb =
      std::find_if(known.begin(), known.end(), [name](const Verb& v) { return v.name == name; });
  if (name.empty()) {
    std::fprintf(stderr, "tessera: which verb?\n\n%s", help_text().c_str());
    return kWrongUsage;
  }
  if (verb == known.end()) {
    return unknown_verb(std::string(name));
  }
  if (verb->run == nullptr) {
    return execute_sibling(argv);
  }
  return verb->run(Args(argv + 2, argv + argc));
}

}  // namespace
}  // namespace cli

int main(int argc, char** argv) {
  try {
    return cli::checked_output("tessera", cli::dispatch(argc, argv));
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "tessera: out of memory\n");
    return cli::kFailed;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tessera: %s\n", cli::shown(error.what()).c_str());
    return cli::kFailed;
  }
}
