// The verb `serve`: reads its flags and runs the server.
#include <algorithm>
#include <cstdio>

#include "server/app.h"
#include "server/http/client_address.h"

namespace server {
namespace {

/// Checks rules that no single flag's row can check.
core::Status check_config(const Config& config) {
  if (config.tls_cert.empty() != config.tls_key.empty()) {
    return core::Error{
        core::ErrorCode::kInvalidArgument, "--tls-cert and --tls-key must be given together", {}};
  }
  const auto trusted = Networks::parse(config.trusted_proxies);
  return trusted ? core::ok_status()
                 : core::Status(core::Error{trusted.error().code, trusted.error().message,
                                            "--trusted-proxies"});
}

core::Result<Config> read_config(std::span<const std::string_view> args) {
  auto config = parse_config(args, process_environ);
  if (config) {
    if (const auto checked = check_config(*config); !checked) {
      return checked.error();
    }
  }
  return config;
}

/// Every user who can list this machine's processes sees the command line.
void warn_of_open_key(std::span<const std::string_view> args, const Config& config) {
  const bool is_open = std::any_of(args.begin(), args.end(), [](std::string_view arg) {
    return arg == "--key" || arg.starts_with("--key=");
  });
  if (is_open && !is_loopback(config.listen)) {
    std::fputs(
        "tessera serve: warning: --key on the command line can be read by every user of this "
        "machine; set TESSERA_KEY, or `key = ` in the file of --config\n",
        stderr);
  }
}

}  // namespace

int serve_command(std::span<const std::string_view> args) {
  if (std::any_of(args.begin(), args.end(),
                  [](std::string_view a) { return a == "--help" || a == "-h"; })) {
    std::fputs(config_help().c_str(), stdout);
    return 0;
  }
  if (args.size() == 1 && args.front() == "--describe") {
    std::fputs(config_description().c_str(), stdout);
    return 0;
  }
  const auto config = read_config(args);
  if (!config) {
    const std::string& where = config.error().where;
    const std::string& message = config.error().message;
    std::fprintf(stderr, "tessera serve: %s%s%s%s `tessera serve --help` lists the flags.\n",
                 where.c_str(), where.empty() ? "" : ": ", message.c_str(),
                 message.back() == '?' ? "" : ".");
    return 2;
  }
  if (config->print_config) {
    std::fputs(config_text(*config).c_str(), stdout);
    return 0;
  }
  for (const std::string& warning : config->warnings) {
    std::fprintf(stderr, "tessera serve: warning: %s\n", warning.c_str());
  }
  warn_of_open_key(args, *config);
  return serve(*config, [args] { return read_config(args); });
}

}  // namespace server
