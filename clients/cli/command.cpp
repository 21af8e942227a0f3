#include "clients/cli/command.h"

#include <cstdio>
#include <utility>

#include "clients/cli/api_client.h"

namespace cli {

int parse_and_run(CLI::App& app, const Args& args, const std::function<int()>& body,
                  const std::function<Choices()>& choices) {
  if (args.size() == 1 && args.front() == kDescribe) {
    std::printf("%s\n", describe(app, choices ? choices() : Choices()).dump().c_str());
    return kDone;
  }
  try {
    // CLI11 takes the arguments from the back.
    Args reversed(args.rbegin(), args.rend());
    app.parse(std::move(reversed));
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
      return app.exit(error) == 0 ? kDone : kWrongUsage;  // --help
    }
    const std::string fault = fault_of(app, error);
    const char* stop = fault.back() == '?' || fault.back() == '.' ? "" : ".";
    std::fprintf(stderr, "%s: %s%s `%s --help` lists what there is.\n", app.get_name().c_str(),
                 fault.c_str(), stop, app.get_name().c_str());
    return kWrongUsage;
  }
  return body();
}

int complain(const std::string& verb, const core::Error& error) {
  const std::string place = error.where.empty() ? "" : error.where + ": ";
  std::fprintf(stderr, "tessera %s: %s%s\n", verb.c_str(), place.c_str(), error.message.c_str());
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
  app.add_option("--key", flags.key, "Access key, if the server asks for one")
      ->envname("TESSERA_KEY")
      ->type_name("KEY");
}

}  // namespace cli
