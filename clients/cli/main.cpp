// tessera: the client verbs. `serve`, `render` and `lab` are the program tessera-server next to it, which is
// executed in this one's place: client verbs start without the renderer's and OpenImageIO's libraries.
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "clients/cli/cli.h"

namespace cli {
namespace {

std::string help_text() {
  std::string text = "tessera: pictures from glTF scenes, with an honest error bar\n\nUsage: tessera VERB ...\n\n";
  for (const Verb& verb : verbs()) {
    std::string name(verb.name);
    name.resize(12, ' ');
    text += "  " + name + std::string(verb.summary) + "\n";
  }
  return text + "\n`tessera VERB --help` says more. Exit codes: 0 done, 1 failed, 2 wrong usage.\n";
}

int execute_sibling(char** argv) {
  std::error_code problem;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", problem);
  const std::string program = (self.parent_path() / "tessera-server").string();
  execvp(program.c_str(), argv);  // without /proc: the one in PATH
  std::fprintf(stderr, "tessera: cannot start %s: %s\n", program.c_str(), std::strerror(errno));
  return kFailed;
}

int dispatch(int argc, char** argv) {
  const std::string_view name = argc > 1 ? argv[1] : "";
  if (name == "--help" || name == "-h" || name == "help") {
    std::fputs(help_text().c_str(), stdout);
    return kDone;
  }
  if (name == "--version") {
    std::puts("tessera " TESSERA_VERSION);
    return kDone;
  }
  const auto known = verbs();
  const auto verb = std::find_if(known.begin(), known.end(), [name](const Verb& v) { return v.name == name; });
  if (verb == known.end()) {
    const std::string given(name);
    std::fprintf(stderr, "%s%s\n\n%s", name.empty() ? "tessera: which verb?" : "tessera: unknown verb: ",
                 given.c_str(), help_text().c_str());
    return kWrongUsage;
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
    return cli::dispatch(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tessera: %s\n", error.what());
    return cli::kFailed;
  }
}
