#include "server/config/config.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <sstream>
#include <system_error>
#include <utility>

#include <arpa/inet.h>
#include <netinet/in.h>

#include "api/flags/flags.h"
#include "api/json/limits.h"
#include "core/base/shown_address.h"
#include "core/base/text.h"
#include "core/scene_io/convert.h"
#include "server/http/text.h"
#include "server/origin.h"

namespace server {
namespace {

using core::Error;
using core::ErrorCode;
using core::Status;

constexpr const char* kSecret = "SECRET";  // Values of this type are never printed.

/// Accepts "50%", or bytes as "4096", "512M", "2G": powers of 1024.
CLI::Validator share_or_bytes() {
  return {[](std::string& text) {
            return text.ends_with('%') ? flags::within(1, 100)(text.substr(0, text.size() - 1))
                                       : CLI::AsSizeValue(false)(text);
          },
          ""};
}

std::vector<std::string> split_commas(const std::string& text) {
  const std::vector<std::string_view> parts = split_list(text);
  return {parts.begin(), parts.end()};
}

/// Returns EXTENSION=PROGRAM with the extension in lower case and without a dot.
core::Result<std::string> converter_entry(std::string_view text) {
  const std::size_t equals = std::min(text.find('='), text.size());
  const std::string extension = core::extension_of_name(
      "." + std::string(text.substr(text.starts_with('.') ? 1 : 0,
                                    equals - (text.starts_with('.') ? 1 : 0))));
  const std::string_view program = text.substr(std::min(equals + 1, text.size()));
  if (extension.empty() || !program.starts_with('/')) {
    return core::Error{
        core::ErrorCode::kInvalidArgument,
        "\"" + std::string(text) + "\" is not EXTENSION=PROGRAM with the program's whole path", ""};
  }
  return extension + "=" + std::string(program);
}

/// Rewrites each entry of a list in its one spelling, and refuses entries that could never match.
CLI::Validator each_entry(core::Result<std::string> (*parse)(std::string_view)) {
  return {[parse](std::string& text) -> std::string {
            std::vector<std::string> entries = split_commas(text);
            for (std::string& entry : entries) {
              auto parsed = parse(entry);
              if (!parsed) {
                return parsed.error().message;
              }
              entry = *std::move(parsed);
            }
            text = CLI::detail::join(entries, ",");
            return {};
          },
          ""};
}

const std::vector<std::string> kLogLevels = {"debug", "info", "warning", "error", "off"};

/// Adds options to an app; the members' values are the defaults.
class Rows {
 public:
  explicit Rows(CLI::App& app) : app_(app) {
    app.option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  }

  /// Adds a number or text.
  template <typename Member>
  CLI::Option* operator()(const char* name, Member& member, const char* value,
                          const char* text) const {
    return app_.add_option("--" + std::string(name), member, text)
        ->capture_default_str()
        ->type_name(value);
  }

  CLI::Option* operator()(const char* name, Share& member, const char* value,
                          const char* text) const {
    const auto read = [&member](const std::string& given) {
      const bool percent = given.ends_with('%');
      member = {.percent = percent ? std::stod(given) : 0,
                .bytes = percent ? 0 : std::stoull(given)};
    };
    const std::string now = member.percent > 0 ? CLI::detail::to_string(member.percent) + "%"
                                               : std::to_string(member.bytes);
    return read_by(name, read, now, value, text);
  }

  CLI::Option* operator()(const char* name, std::vector<std::string>& member, const char* value,
                          const char* text) const {
    const auto read = [&member](const std::string& given) { member = split_commas(given); };
    return read_by(name, read, CLI::detail::join(member, ","), value, text);
  }

  CLI::Option* operator()(const char* name, LogLevel& member, const char* value,
                          const char* text) const {
    const auto read = [&member](const std::string& given) {
      const auto found = std::find(kLogLevels.begin(), kLogLevels.end(), given);
      member = static_cast<LogLevel>(found - kLogLevels.begin());
    };
    return read_by(name, read, kLogLevels[static_cast<std::size_t>(member)], value, text);
  }

  CLI::Option* off(const char* name, bool& member, const char* text) const {
    return app_.add_flag("--" + std::string(name), member, text)
        ->default_str(member ? "true" : "false");
  }

 private:
  CLI::Option* read_by(const char* name, const std::function<void(const std::string&)>& read,
                       const std::string& now, const char* value, const char* text) const {
    return app_.add_option_function<std::string>("--" + std::string(name), read, text)
        ->default_str(now)
        ->type_name(value);
  }

  CLI::App& app_;
};

/// One row per flag. Its variable, its line in a configuration file, --help, --print-config,
/// completions and the manual page are derived from it.
void add_flags(CLI::App& app, Config& config) {
  const Rows row(app);
  row("listen", config.listen, "ADDRESS",
      "Address to listen on. Non-local addresses require a key.");
  row("port", config.port, "N", "Port; 0 selects a free one.")->check(flags::within(0, 65535));
  row("data", config.data_dir, "DIR",
      "Directory for jobs, assets and films ($XDG_DATA_HOME/tessera).");
  row("threads", config.threads, "N", "Render threads; 0: as many as the machine has.")
      ->check(flags::within(0, 1024));
  row("isa", config.isa, "NAME",
      "Limit Embree to an instruction set: native, sse2, sse4.2, avx, avx2, avx512, neon.");
  row("key", config.key, kSecret,
      "Access key required on every request. Without a key, only local connections are accepted.")
      ->transform(flags::key_text());
  row("key-file", config.key_file, "FILE", "File whose first line is the key of --key.");
  row.off("shared", config.shared, "Let all keys see and change the objects of all tenants.");
  row("worker-key", config.worker_key, kSecret,
      "Key for `tessera worker` that gives access to nothing else, as `keys add --scope worker`.")
      ->transform(flags::key_text());
  row("metrics-key", config.metrics_key, kSecret,
      "Key required by /metrics; without it, /metrics needs no key.")
      ->transform(flags::key_text());
  row("hosts", config.hosts, "A,B", "Host names to accept besides the loopback names.")
      ->transform(each_entry(parse_host));
  row("origins", config.origins, "A,B",
      "Origins of other pages that may call this server (CORS), such as https://shop.example.org.")
      ->transform(each_entry(parse_origin));
  row("embed-origins", config.embed_origins, "A,B",
      "Origins of other pages that may show /embed/JOB in a frame.")
      ->transform(each_entry(parse_origin));
  row.off("demo", config.demo, "Submit a demo job if there are no jobs yet.");
  row("grace", config.grace_seconds, "SECONDS", "Maximum shutdown time after SIGTERM.")
      ->check(flags::within(0, 3600));
  row("log-level", config.log_level, "LEVEL", "debug, info, warning, error or off.")
      ->check(CLI::IsMember(kLogLevels).description(""));
  row("max-queue", config.queue_max, "N", "Maximum number of queued jobs; more are refused (429).")
      ->check(flags::within(0, 1000000));
  row("max-running", config.running_max, "N", "Maximum number of jobs that render concurrently.")
      ->check(flags::within(1, 1024));
  row("memory", config.memory, "BYTES|N%",
      "Memory for jobs, requests and caches together; a percentage refers to the memory that this "
      "process may use. Work that does not fit waits or is refused; paused jobs are moved to the "
      "disk.")
      ->transform(share_or_bytes());
  row("max-streams", config.streams_max, "N", "Maximum number of open event and tile streams.")
      ->check(flags::within(1, 60000));
  row("max-wait", config.wait_max_seconds, "SECONDS",
      "Longest time that ?wait and Prefer: wait are honoured. Proxies give up after 60 seconds "
      "without a byte, some after 30.")
      ->check(flags::within(0, static_cast<double>(api::limits::kWaitSeconds)));
  row("max-lab-runs", config.lab_runs_max, "N",
      "Maximum number of concurrent laboratory runs, one thread each; more are refused (429).")
      ->check(flags::within(1, 64));
  row("max-samples", config.samples_max, "N", "Maximum samples per pixel of a job.")
      ->check(flags::within(1, 65536));
  row("max-upload", config.upload_bytes_max, "BYTES", "Maximum size of an upload.")
      ->transform(CLI::AsSizeValue(false));
  row("scene-cache", config.scene_cache, "BYTES|N%", "Memory for cached scenes.")
      ->transform(share_or_bytes());
  row("film-cache", config.film_cache, "BYTES|N%", "Memory for cached films of ended jobs.")
      ->transform(share_or_bytes());
  row("checkpoint", config.checkpoint_seconds, "SECONDS",
      "Time between checkpoints of a rendering job.")
      ->check(flags::within(0, 3600));
  row("retention", config.retention_seconds, "SECONDS",
      "Delete ended jobs and their films after this time; 0: keep them.")
      ->check(flags::within(0, static_cast<int>(api::limits::kRetentionSeconds)));
  row("max-ended", config.ended_max, "N",
      "Maximum number of ended jobs; beyond it the oldest are deleted. 0: no limit.")
      ->check(flags::within(0, 1000000000));
  row("disk-limit", config.disk_limit, "BYTES|N%",
      "Maximum size of assets and films: above it, films of ended jobs are evicted, oldest first, "
      "and uploads are refused.")
      ->transform(share_or_bytes());
  row("rate-limit", config.rate_limit, "N",
      "Requests per minute for each key of `tessera keys`; 0: no limit.")
      ->check(flags::within(0, 100000000));
  row("quota-jobs", config.quota_jobs, "N",
      "Maximum number of unfinished jobs per tenant; 0: no limit.")
      ->check(flags::within(0, 1000000));
  row("quota-storage", config.quota_storage, "BYTES|N%",
      "Maximum size of assets and films per tenant; a percentage refers to --disk-limit. 0: no "
      "limit.")
      ->transform(share_or_bytes());
  row("quota-previews", config.quota_previews, "N",
      "Maximum number of concurrent previews per tenant (of 32 in total); 0: no limit.")
      ->check(flags::within(0, 1000));
  row("quota-streams", config.quota_streams, "N",
      "Maximum number of open streams per tenant; 0: no limit.")
      ->check(flags::within(0, 60000));
  row("quota-lab-runs", config.quota_lab_runs, "N",
      "Maximum number of concurrent experiments per tenant; 0: no limit.")
      ->check(flags::within(0, 64));
  row("audit-log", config.audit_log, "FILE",
      "Write the audit log (changes and refused requests) to FILE instead of the main log.");
  row("webhook-secret", config.webhook_secret, kSecret,
      "Secret that signs webhooks, whsec_ and base64 (created in the data directory).");
  row("converters", config.converters, "EXT=PROGRAM,EXT=PROGRAM",
      "Programs that convert uploads of other formats, such as step=/usr/local/bin/step2glb: "
      "called with the file and the name of the GLB to write, without a network.")
      ->transform(each_entry(&converter_entry));
  row("convert-seconds", config.convert_seconds, "SECONDS",
      "Longest time for the conversion of an upload.")
      ->check(flags::within(1, 3600));
  row.off("drake", config.drake,
          "Serve Drake's glTF render protocol at /render, too, where its client looks by default.");
  row.off("webhook-private", config.webhook_private,
          "Allow webhooks to loopback and private addresses, and through the proxy of the "
          "environment.");
  row("trusted-proxies", config.trusted_proxies, "CIDR,CIDR",
      "Networks of proxies whose Forwarded or X-Forwarded-For, -Proto, -Host and -Port are "
      "trusted.");
  row("tls-cert", config.tls_cert, "FILE",
      "Certificate chain (PEM); with --tls-key the server uses HTTPS.");
  row("tls-key", config.tls_key, "FILE", "Private key of the certificate (PEM).");
  row("queue", config.queue, "URL",
      "NATS server (nats://HOST:4222, tls://...) that distributes parts of images to `tessera "
      "worker`.");
  row("queue-creds", config.queue_creds, "FILE", "Credentials (JWT and seed) for --queue.");
  row("queue-ca", config.queue_ca, "FILE",
      "CA certificates (PEM) that verify the server of --queue.");
  row("render-threads", config.render_threads, "N",
      "With --queue: threads of this server that render in addition to the workers.")
      ->check(flags::within(0, 1024));
  row("lease", config.lease_seconds, "SECONDS",
      "With --queue: time without progress after which a part is given to another worker.")
      ->check(flags::within(0.5, 3600));
  row("verify", config.verify_share, "SHARE",
      "With --queue: fraction of the parts that two workers render, or a single one and the "
      "server, and whose results are compared.")
      ->check(flags::within(0, 1));
  row("announce", config.announce, "URL",
      "Public URL to print, if it differs from the listen address.")
      ->configurable(false);
  row("base-path", config.base_path, "PATH",
      "Path below which a proxy places this server, such as /render; the proxy removes it from "
      "requests. A trusted proxy may set X-Forwarded-Prefix instead.")
      ->transform(CLI::Validator(
          [](std::string& text) -> std::string {
            const auto path = base_path(text);
            if (!path) {
              return "\"" + core::shown_address(text) + "\" is not a path such as /render";
            }
            text = *path;
            return {};
          },
          ""));
  row("config", config.config_file, "FILE",
      "Configuration file with lines `flag = value`; variables and flags take precedence.")
      ->configurable(false);
  row.off("print-config", config.print_config, "Print the effective configuration and exit.")
      ->configurable(false);
}

std::string variable_name(std::string flag) {
  std::transform(flag.begin(), flag.end(), flag.begin(), [](unsigned char c) {
    return c == '-' ? '_' : static_cast<char>(std::toupper(c));
  });
  return "TESSERA_" + flag;
}

/// Kubernetes and Docker's links set <SERVICE>_PORT=tcp://ADDRESS:PORT for each service beside the
/// process: a service named `tessera` thereby sets TESSERA_PORT.
bool is_service_link(std::string_view value) {
  return value.starts_with("tcp://") || value.starts_with("udp://") || value.starts_with("sctp://");
}

/// Returns an app for --help and --describe, which print defaults and variables.
std::unique_ptr<CLI::App> described_app() {
  Config defaults;
  auto app = std::make_unique<CLI::App>(
      "Starts the server. Every flag has an environment variable; a flag overrides its variable, "
      "which overrides the file of --config.",
      "tessera serve");
  add_flags(*app, defaults);
  for (CLI::Option* option : app->get_options([](const CLI::Option*) { return true; })) {
    if (option != app->get_help_ptr()) {
      option->envname(variable_name(option->get_single_name()));
    }
  }
  return app;
}

Status apply_args(CLI::App& app, std::span<const std::string_view> args, std::string where) {
  std::vector<std::string> words;
  for (const std::string_view arg : args) {
    // CLI11 would read the next word as the value of "--key=".
    const bool empty = arg.starts_with("--") && arg.find('=') == arg.size() - 1;
    words.emplace_back(arg.substr(0, arg.size() - (empty ? 1 : 0)));
    if (empty) {
      words.emplace_back();
    }
  }
  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
  } catch (const CLI::ParseError& error) {
    return Error{ErrorCode::kInvalidArgument, flags::fault_of(app, error), std::move(where)};
  }
  return core::ok_status();
}

Status apply_value(CLI::App& app, const std::string& name, const std::string& value,
                   std::string where) {
  const std::string arg = "--" + name + "=" + value;
  return apply_args(app, std::array{std::string_view(arg)}, std::move(where));
}

/// Reads a file of settings. Streams open directories and keep silent about errors while reading.
core::Result<std::string> read_text(const std::string& path) {
  std::error_code failed;
  if (std::filesystem::is_directory(path, failed)) {
    return Error{ErrorCode::kInvalidArgument, "is a directory; a file is expected", path};
  }
  std::ifstream file(path, std::ios::binary);
  std::string text;
  try {
    text.assign(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  } catch (const std::ios_base::failure&) {
    file.setstate(std::ios::failbit);
  }
  if (!file.good() && !file.eof()) {
    return Error{ErrorCode::kInvalidArgument, "cannot be read", path};
  }
  if (text.find('\0') != std::string::npos) {
    return Error{ErrorCode::kInvalidArgument, "is not text in UTF-8", path};
  }
  return std::string(core::without_byte_order_mark(text));
}

/// Reads `flag = value` on each line; lines that begin with `#` are comments.
Status apply_file(CLI::App& app, const std::string& path) {
  const auto text = read_text(path);
  if (!text) {
    return text.error();
  }
  std::istringstream lines(*text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    CLI::detail::trim(line);
    if (line.empty() || line.front() == '#') {
      continue;
    }
    const std::string where = path + ", line " + std::to_string(number);
    const auto equals = line.find('=');
    const std::string name = CLI::detail::trim_copy(line.substr(0, equals));
    const CLI::Option* option = app.get_option_no_throw("--" + name);
    if (option == nullptr || !option->get_configurable()) {
      return Error{ErrorCode::kInvalidArgument, "\"" + name + "\" cannot be set here", where};
    }
    if (equals == std::string::npos) {
      return Error{ErrorCode::kInvalidArgument, "expected `flag = value`", where};
    }
    const std::string value = CLI::detail::trim_copy(line.substr(equals + 1));
    if (auto status = apply_value(app, name, value, where); !status) {
      return status;
    }
  }
  return core::ok_status();
}

std::string default_data_dir(const Environ& environ) {
  if (const auto data = environ("XDG_DATA_HOME"); data && !data->empty()) {
    return *data + "/tessera";
  }
  if (const auto home = environ("HOME"); home && !home->empty()) {
    return *home + "/.local/share/tessera";
  }
  return "tessera-data";
}

/// Reads the key from the first line of the file.
Status read_key_file(Config& config) {
  if (config.key_file.empty()) {
    return core::ok_status();
  }
  if (!config.key.empty()) {
    return Error{ErrorCode::kInvalidArgument, "cannot be combined with --key", "--key-file"};
  }
  const auto text = read_text(config.key_file);
  if (!text) {
    return text.error();
  }
  std::istringstream(*text) >> config.key;
  if (config.key.empty()) {
    return Error{ErrorCode::kInvalidArgument, "has no key", config.key_file};
  }
  return core::ok_status();
}

}  // namespace

std::optional<std::string> process_environ(const std::string& name) {
  const char* value = std::getenv(name.c_str());  // NOLINT(concurrency-mt-unsafe): before threads.
  return value == nullptr ? std::nullopt : std::optional<std::string>(value);
}

core::Result<std::string> data_directory(const std::string& given) {
  if (!given.empty()) {
    return given;
  }
  const auto config = parse_config({}, process_environ);
  return config ? core::Result<std::string>(config->data_dir) : config.error();
}

core::Result<Config> parse_config(std::span<const std::string_view> args, const Environ& environ) {
  Config config;
  CLI::App app("", "tessera serve");
  add_flags(app, config);
  // Flags take precedence and are applied last; also first, because they may name the file.
  if (auto status = apply_args(app, args, ""); !status) {
    return status.error();
  }
  if (config.config_file.empty()) {
    config.config_file = environ("TESSERA_CONFIG").value_or("");
  }
  if (!config.config_file.empty()) {
    if (auto status = apply_file(app, config.config_file); !status) {
      return status.error();
    }
  }
  for (const CLI::Option* option : app.get_options()) {
    const std::string name = option->get_single_name();
    // Empty variables count as unset: compose files pass `${NAME:-}`.
    const std::string value = environ(variable_name(name)).value_or("");
    if (is_service_link(value)) {
      config.warnings.push_back(variable_name(name) + "=" + core::shown_address(value) +
                                " is ignored: it is the link of a service, not a setting");
    } else if (!value.empty() && option != app.get_help_ptr()) {
      if (auto status = apply_value(app, name, value, variable_name(name)); !status) {
        return status.error();
      }
    }
  }
  if (auto status = apply_args(app, args, ""); !status) {
    return status.error();
  }
  if (auto status = read_key_file(config); !status) {
    return status.error();
  }
  if (config.data_dir.empty()) {
    config.data_dir = default_data_dir(environ);
  }
  return config;
}

std::string config_text(const Config& config) {
  Config shown = config;
  CLI::App app;
  add_flags(app, shown);
  std::string text = "# tessera serve; read with --config FILE\n";
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_configurable()) {
      const std::string value = option->get_default_str();
      const bool is_secret = option->get_type_name() == kSecret && !value.empty();
      const bool is_url = option->get_type_name() == "URL";
      const std::string safe = is_secret ? "(not shown)"
                               : is_url  ? core::shown_address(value)
                                         : value;
      text += (safe == value ? "" : "# ") + option->get_single_name() + " = " + safe + "\n";
    }
  }
  return text;
}

std::vector<std::string> changed_flags(const Config& before, const Config& after) {
  Config first = before;
  Config second = after;
  CLI::App old_app;
  CLI::App new_app;
  add_flags(old_app, first);
  add_flags(new_app, second);
  std::vector<std::string> changed;
  for (const CLI::Option* option : old_app.get_options()) {
    const std::string name = option->get_single_name();
    const CLI::Option* now = new_app.get_option_no_throw("--" + name);
    if (now != nullptr && option->get_configurable() &&
        option->get_default_str() != now->get_default_str()) {
      changed.push_back(name);
    }
  }
  return changed;
}

std::string config_help() { return described_app()->help(); }

std::string config_description() { return flags::describe(*described_app()).dump() + "\n"; }

bool is_loopback(std::string_view host) {
  if (equal_ignoring_case(host, "localhost") || host == "::1" || host == "[::1]") {
    return true;
  }
  // The whole name must be an address: 127.0.0.1.example.org can belong to anyone.
  in_addr address = {};
  return ::inet_pton(AF_INET, std::string(host).c_str(), &address) == 1 &&
         (ntohl(address.s_addr) >> 24U) == 127;
}

}  // namespace server
