// Starts the Model Context Protocol server of the Python package, in place of this program.
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include <unistd.h>

#include "clients/cli/command.h"

namespace cli {
namespace {

constexpr const char* kText =
    "Serves the tools of an agent (Model Context Protocol): render, views, inspect, compare and "
    "improve, over stdio or at http://127.0.0.1:PORT/mcp. The Python package does it: "
    "pip install \"tessera-render[mcp]\" for the python3 in PATH. It needs a running server.";

/// Says what is missing in one sentence instead of a traceback.
constexpr const char* kProgram =
    "import importlib.util, sys\n"
    "if importlib.util.find_spec('tessera_render') is None:\n"
    "    sys.exit('tessera mcp: ' + sys.executable + ' has no package tessera_render; install '\n"
    "             'it: pip install \"tessera-render[mcp]\"')\n"
    "from tessera_render.mcp import main\n"
    "main(sys.argv[1:])\n";

}  // namespace

int mcp(const Args& args) {
  CLI::App app(kText, "tessera mcp");
  ServerFlags server;
  std::string port;
  std::string files;
  add_server_flags(app, server);
  auto* const listens = app.add_option("--port", port, "Listen on this port of 127.0.0.1, /mcp")
                            ->check(CLI::Range(1, 65535))
                            ->type_name("PORT");
  app.add_option("--files", files, "Folder whose files agents may read over HTTP")
      ->needs(listens)
      ->type_name("FOLDER");
  return parse_and_run(app, args, [&] {
    // Unlike flags, the environment of a process is not shown to other users.
    setenv("TESSERA_SERVER", server.url.c_str(), 1);
    if (!server.key.empty()) {
      setenv("TESSERA_KEY", server.key.c_str(), 1);
    }
    std::vector<std::string> words = {"python3", "-c", kProgram};
    if (!port.empty()) {
      words.insert(words.end(), {"--port", port});
    }
    if (!files.empty()) {
      words.insert(words.end(), {"--files", files});
    }
    std::vector<char*> argv;
    for (std::string& word : words) {
      argv.push_back(word.data());
    }
    argv.push_back(nullptr);
    execvp(argv[0], argv.data());
    return complain("mcp", {core::ErrorCode::kNotFound,
                            std::string("cannot start python3: ") + std::strerror(errno), ""});
  });
}

}  // namespace cli
