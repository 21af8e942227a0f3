// Signs URLs of images, without a server.
#include <cstdio>
#include <string>

#include "clients/cli/command.h"
#include "core/base/url_signature.h"

namespace cli {

int sign(const Args& args) {
  CLI::App app("Signs the path of an image made from a preset, and prints it as on the server.",
               "tessera sign");
  std::string path;
  std::string key;
  app.add_option("path", path, "/PRESET/SCENE/THETA,PHI.FORMAT, with its query")
      ->required()
      ->type_name("PATH");
  app.add_option("--key", key, "Key of POST /v1/signing-keys")
      ->envname("TESSERA_SIGNING_KEY")
      ->required()
      ->type_name("KEY");
  return parse_and_run(app, args, [&] {
    if (!path.starts_with('/')) {
      return complain("sign",
                      {core::ErrorCode::kInvalidArgument, "the path must begin with /", path});
    }
    std::printf("/i/%s%s\n", core::url_signature(key, path).c_str(), path.c_str());
    return kDone;
  });
}

}  // namespace cli
