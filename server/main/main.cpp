// tessera-server: the verbs that need the renderer or the store. The program `tessera`
// (clients/cli) executes it in place of itself.
#include <cstdio>
#include <exception>
#include <new>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "clients/cli/cli.h"
#include "clients/cli/output.h"
#include "server/app.h"
#include "server/commands/backup_command.h"
#include "server/commands/check_command.h"
#include "server/commands/keys_command.h"

namespace {

int dispatch(std::span<char*> args) {
  const std::string_view verb = args.size() > 1 ? args[1] : "";
  if (verb == "serve") {
    return server::serve_command(std::vector<std::string_view>(args.begin() + 2, args.end()));
  }
  if (verb == "keys" || verb == "check" || verb == "backup") {
    const std::vector<std::string> rest(args.begin() + 2, args.end());
    return verb == "keys"    ? server::keys_command(rest)
           : verb == "check" ? server::check_command(rest)
                             : server::backup_command(rest);
  }
  if (verb == "convert") {
    return cli::convert(cli::Args(args.begin() + 2, args.end()));
  }
  if (verb == "denoise") {
    return cli::denoise(cli::Args(args.begin() + 2, args.end()));
  }
  if (verb == "render") {
    return cli::render(cli::Args(args.begin() + 2, args.end()));
  }
  if (verb == "lab") {
    return cli::lab_command(cli::Args(args.begin() + 2, args.end()));
  }
  if (verb == "worker") {
    return cli::worker(cli::Args(args.begin() + 2, args.end()));
  }
  std::fprintf(stderr,
               "tessera-server: has only the verbs serve, keys, check, backup, worker, convert, "
               "denoise, render and lab; `tessera --help` lists all verbs\n");
  return cli::kWrongUsage;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return cli::checked_output("tessera", dispatch({argv, static_cast<std::size_t>(argc)}));
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "tessera-server: out of memory\n");
    return cli::kFailed;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tessera-server: %s\n", error.what());
    return cli::kFailed;
  }
}
