#include <unistd.h>

#include "clients/cli/cli.h"
#include "clients/cli/command.h"
#include "core/denoise/oidn_helper.h"

namespace cli {

int denoise(const Args& args) {
  CLI::App app(
      "Helper process of Open Image Denoise. `serve` and `render` start it with a socket as its "
      "standard input.",
      "tessera denoise");
  std::string folder;
  app.add_option("folder", folder, "Folder with libOpenImageDenoise.so.2")
      ->required()
      ->type_name("FOLDER");
  return parse_and_run(app, args,
                       [&] { return core::serve_oidn(STDIN_FILENO, folder) ? kDone : kFailed; });
}

}  // namespace cli
