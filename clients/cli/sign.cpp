// Signs URLs of images, without a server.
#include <algorithm>
#include <cstdio>
#include <string>
#include <string_view>

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
      ->transform(flags::key_text())
      ->required()
      ->type_name("KEY");
  return parse_and_run(app, args, [&] {
    if (!path.starts_with('/')) {
      return complain("sign",
                      {core::ErrorCode::kInvalidArgument, "the path must begin with /", path});
    }
    // A browser would encode these, and ask for another URL than the signed one.
    const auto is_encoded = [](char c) {
      return c <= ' ' || c > '~' || std::string_view("\"#'<>").find(c) != std::string_view::npos;
    };
    if (std::any_of(path.begin(), path.end(), is_encoded)) {
      return complain("sign", {core::ErrorCode::kInvalidArgument,
                               "spaces, quotes, #, <, > and letters beyond ASCII must be encoded "
                               "first, such as %20",
                               path});
    }
    std::printf("/i/%s%s\n", core::url_signature(key, path).c_str(), path.c_str());
    return kDone;
  });
}

}  // namespace cli
