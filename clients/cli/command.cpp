#include "clients/cli/command.h"

#include <cstdio>

#include "clients/cli/api_client.h"
#include "clients/cli/shown.h"

namespace cli {

int complain(const std::string& verb, const core::Error& error) {
  const std::string place = error.where.empty() ? "" : error.where + ": ";
  std::fprintf(stderr, "tessera %s: %s\n", verb.c_str(), shown(place + error.message).c_str());
  return kFailed;
}

void add_server_flags(CLI::App& app, ServerFlags& flags) {
  app.add_option("--server", flags.url, "Address of the server")
      ->envname("TESSERA_SERVER")
      ->capture_default_str()
      ->check(CLI::Validator(
          [](const std::string& url) {
            const auto address = check_address(url);
            return address ? std::string() : address.error().message;
          },
          ""))
      ->type_name("URL");
  app.add_option("--key", flags.key, "Access key, if the server requires one")
      ->envname("TESSERA_KEY")
      ->transform(flags::key_text())
      ->type_name("KEY");
}

}  // namespace cli
