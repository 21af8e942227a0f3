#include "server/config.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <type_traits>

#include <arpa/inet.h>
#include <netinet/in.h>

#include <nlohmann/json.hpp>

namespace server {
namespace {

using core::Error;
using core::ErrorCode;
using core::Status;

Error refuse(std::string message) { return Error{ErrorCode::kInvalidArgument, std::move(message), ""}; }

template <typename Number>
core::Result<Number> parse_number(std::string_view text, Number min, Number max) {
  Number value{};
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size()) {
    return refuse("\"" + std::string(text) + "\" is not a number");
  }
  if (!(value >= min && value <= max)) {
    return refuse(std::string(text) + " is outside [" + std::to_string(min) + ", " +
                  std::to_string(max) + "]");
  }
  return value;
}

/// "4096", "512M", "2G": powers of 1024.
core::Result<std::uint64_t> parse_bytes(std::string_view text) {
  std::uint64_t unit = 1;
  if (!text.empty()) {
    const std::string_view units = "KMGT";
    const auto found = units.find(static_cast<char>(std::toupper(static_cast<unsigned char>(text.back()))));
    if (found != std::string_view::npos) {
      unit = std::uint64_t{1} << (10U * (static_cast<unsigned>(found) + 1U));
      text.remove_suffix(1);
    }
  }
  const auto count = parse_number<std::uint64_t>(text, 0, (std::uint64_t{1} << 62U) / unit);
  if (!count) {
    return count.error();
  }
  return *count * unit;
}

std::vector<std::string> split_commas(std::string_view text) {
  std::vector<std::string> parts;
  while (!text.empty()) {
    const auto comma = text.find(',');
    const std::string_view part = text.substr(0, comma);
    if (!part.empty()) {
      parts.emplace_back(part);
    }
    text = comma == std::string_view::npos ? std::string_view() : text.substr(comma + 1);
  }
  return parts;
}

template <int Config::*member, int min, int max>
Status set_int(Config& config, std::string_view text) {
  const auto value = parse_number<int>(text, min, max);
  if (!value) {
    return value.error();
  }
  config.*member = *value;
  return core::ok_status();
}

template <std::uint64_t Config::*member>
Status set_bytes(Config& config, std::string_view text) {
  const auto value = parse_bytes(text);
  if (!value) {
    return value.error();
  }
  config.*member = *value;
  return core::ok_status();
}

template <double Config::*member, int min, int max>
Status set_seconds(Config& config, std::string_view text) {
  const auto value = parse_number<double>(text, min, max);
  if (!value) {
    return value.error();
  }
  config.*member = *value;
  return core::ok_status();
}

template <std::string Config::*member>
Status set_text(Config& config, std::string_view text) {
  config.*member = std::string(text);
  return core::ok_status();
}

template <std::vector<std::string> Config::*member>
Status set_list(Config& config, std::string_view text) {
  config.*member = split_commas(text);
  return core::ok_status();
}

/// "512M", or "50%" of something; the one that is not given is 0.
template <std::uint64_t Config::*bytes, double Config::*percent>
Status set_share(Config& config, std::string_view text) {
  if (!text.empty() && text.back() == '%') {
    const auto value = parse_number<double>(text.substr(0, text.size() - 1), 1, 100);
    if (!value) {
      return value.error();
    }
    config.*percent = *value;
    config.*bytes = 0;
    return core::ok_status();
  }
  const Status status = set_bytes<bytes>(config, text);
  if (status) {
    config.*percent = 0;
  }
  return status;
}

constexpr std::array<std::pair<std::string_view, LogLevel>, 5> kLogLevels = {{
    {"debug", LogLevel::kDebug},
    {"info", LogLevel::kInfo},
    {"warning", LogLevel::kWarning},
    {"error", LogLevel::kError},
    {"off", LogLevel::kOff},
}};

Status set_log_level(Config& config, std::string_view text) {
  for (const auto& [name, level] : kLogLevels) {
    if (name == text) {
      config.log_level = level;
      return core::ok_status();
    }
  }
  return refuse("\"" + std::string(text) + "\" is none of debug, info, warning, error, off");
}

template <bool Config::*member>
Status set_switch(Config& config, std::string_view text) {
  if (text != "1" && text != "true" && text != "0" && text != "false") {
    return refuse("\"" + std::string(text) + "\" is neither true nor false");
  }
  config.*member = text == "1" || text == "true";
  return core::ok_status();
}

template <auto member>
std::string show_number(const Config& config) {
  if constexpr (std::is_same_v<decltype(config.*member), const double&>) {
    std::ostringstream text;
    text << config.*member;
    return text.str();
  } else {
    return std::to_string(config.*member);
  }
}

template <std::string Config::*member>
std::string show_text(const Config& config) {
  return config.*member;
}

constexpr std::string_view kHidden = "(not shown)";

template <std::string Config::*member>
std::string show_secret(const Config& config) {
  return (config.*member).empty() ? std::string() : std::string(kHidden);
}

template <bool Config::*member>
std::string show_switch(const Config& config) {
  return config.*member ? "true" : "false";
}

template <std::vector<std::string> Config::*member>
std::string show_list(const Config& config) {
  std::string text;
  for (const std::string& part : config.*member) {
    text += (text.empty() ? "" : ",") + part;
  }
  return text;
}

template <std::uint64_t Config::*bytes, double Config::*percent>
std::string show_share(const Config& config) {
  return config.*percent > 0 ? show_number<percent>(config) + "%" : show_number<bytes>(config);
}

std::string show_log_level(const Config& config) {
  const auto* found = std::find_if(kLogLevels.begin(), kLogLevels.end(),
                                   [&](const auto& each) { return each.second == config.log_level; });
  return std::string(found->first);
}

struct Flag {
  std::string_view name;
  std::string_view value;  ///< What stands for the value in the help; empty: a switch.
  std::string_view text;
  Status (*set)(Config&, std::string_view);
  std::string (*show)(const Config&);  ///< Null: not part of a configuration file.
};

constexpr std::array kFlags = {
    Flag{"listen", "ADDRESS", "Address to listen on (127.0.0.1). Any other than loopback needs a key.",
         &set_text<&Config::listen>, &show_text<&Config::listen>},
    Flag{"port", "N", "Port (8080); 0 takes a free one.",
         &set_int<&Config::port, 0, 65535>, &show_number<&Config::port>},
    Flag{"data", "DIR", "Where jobs, assets and films live ($XDG_DATA_HOME/tessera).",
         &set_text<&Config::data_dir>, &show_text<&Config::data_dir>},
    Flag{"threads", "N", "Render threads (0: as many as the machine has).",
         &set_int<&Config::threads, 0, 1024>, &show_number<&Config::threads>},
    Flag{"isa", "NAME", "Instruction set Embree is held to: native (default), sse2, sse4.2, avx, avx2, avx512.",
         &set_text<&Config::isa>, &show_text<&Config::isa>},
    Flag{"key", "TEXT", "Key that every request must bring; without one only loopback is served.",
         &set_text<&Config::key>, &show_secret<&Config::key>},
    Flag{"hosts", "A,B", "Host names accepted besides the loopback ones.",
         &set_list<&Config::hosts>, &show_list<&Config::hosts>},
    Flag{"origins", "A,B", "Origins of other pages that may call this server (CORS).",
         &set_list<&Config::origins>, &show_list<&Config::origins>},
    Flag{"demo", "", "Submit a demo job when the store has none yet.",
         &set_switch<&Config::demo>, &show_switch<&Config::demo>},
    Flag{"grace", "SECONDS", "Longest time from SIGTERM to the end (10).",
         &set_seconds<&Config::grace_seconds, 0, 3600>, &show_number<&Config::grace_seconds>},
    Flag{"log-level", "LEVEL", "debug, info (default), warning, error or off.",
         &set_log_level, &show_log_level},
    Flag{"max-queue", "N", "Jobs waiting (1000); 429 beyond.",
         &set_int<&Config::queue_max, 0, 1000000>, &show_number<&Config::queue_max>},
    Flag{"max-running", "N", "Jobs rendering at a time (16).",
         &set_int<&Config::running_max, 1, 1024>, &show_number<&Config::running_max>},
    Flag{"memory", "BYTES|N%",
         "Films and scenes of jobs that have begun (70%, of the memory this process may use): others wait, paused ones go to "
         "the disk.",
         &set_share<&Config::memory_bytes, &Config::memory_percent>,
         &show_share<&Config::memory_bytes, &Config::memory_percent>},
    Flag{"max-streams", "N", "Open event and tile streams (2048).",
         &set_int<&Config::streams_max, 1, 60000>, &show_number<&Config::streams_max>},
    Flag{"max-lab-runs", "N", "Runs of the laboratory at a time (2), one thread each; 429 beyond.",
         &set_int<&Config::lab_runs_max, 1, 64>, &show_number<&Config::lab_runs_max>},
    Flag{"max-samples", "N", "Samples per pixel of any job (65536).",
         &set_int<&Config::samples_max, 1, 65536>, &show_number<&Config::samples_max>},
    Flag{"max-upload", "BYTES", "Largest upload (2G).",
         &set_bytes<&Config::upload_bytes_max>, &show_number<&Config::upload_bytes_max>},
    Flag{"scene-cache", "BYTES|N%", "Memory for scenes that stay loaded (10%).",
         &set_share<&Config::scene_cache_bytes, &Config::scene_cache_percent>,
         &show_share<&Config::scene_cache_bytes, &Config::scene_cache_percent>},
    Flag{"film-cache", "BYTES|N%", "Memory for films of ended jobs that stay loaded (5%).",
         &set_share<&Config::film_cache_bytes, &Config::film_cache_percent>,
         &show_share<&Config::film_cache_bytes, &Config::film_cache_percent>},
    Flag{"checkpoint", "SECONDS", "Between checkpoints of a rendering job (10).",
         &set_seconds<&Config::checkpoint_seconds, 0, 3600>, &show_number<&Config::checkpoint_seconds>},
    Flag{"disk-limit", "BYTES|N%",
         "Assets and films: above this films of ended jobs are evicted, oldest first, and uploads refused (80%).",
         &set_share<&Config::disk_limit_bytes, &Config::disk_limit_percent>,
         &show_share<&Config::disk_limit_bytes, &Config::disk_limit_percent>},
    Flag{"rate-limit", "N", "Requests a minute of each key of `tessera keys` (6000); 0 is no limit.",
         &set_int<&Config::rate_limit, 0, 100000000>, &show_number<&Config::rate_limit>},
    Flag{"quota-jobs", "N", "Unfinished jobs of each key of `tessera keys` (0: no limit).",
         &set_int<&Config::quota_jobs, 0, 1000000>, &show_number<&Config::quota_jobs>},
    Flag{"quota-storage", "BYTES|N%",
         "Assets and films of each key of `tessera keys`, a percentage being of --disk-limit (50%); 0 is no limit.",
         &set_share<&Config::quota_storage_bytes, &Config::quota_storage_percent>,
         &show_share<&Config::quota_storage_bytes, &Config::quota_storage_percent>},
    Flag{"quota-previews", "N", "Previews at a time of each key of `tessera keys` (16, of 32 in all); 0 is no limit.",
         &set_int<&Config::quota_previews, 0, 1000>, &show_number<&Config::quota_previews>},
    Flag{"quota-streams", "N", "Open streams of each key of `tessera keys` (0: no limit).",
         &set_int<&Config::quota_streams, 0, 60000>, &show_number<&Config::quota_streams>},
    Flag{"quota-lab-runs", "N", "Experiments at a time of each key of `tessera keys` (1); 0 is no limit.",
         &set_int<&Config::quota_lab_runs, 0, 64>, &show_number<&Config::quota_lab_runs>},
    Flag{"audit-log", "FILE", "Who changed what, and who was refused: lines to this file instead of the log.",
         &set_text<&Config::audit_log>, &show_text<&Config::audit_log>},
    Flag{"webhook-secret", "TEXT", "whsec_ and base64: signs webhooks (made in the data directory).",
         &set_text<&Config::webhook_secret>, &show_secret<&Config::webhook_secret>},
    Flag{"webhook-private", "", "Webhooks may go to loopback and private addresses.",
         &set_switch<&Config::webhook_private>, &show_switch<&Config::webhook_private>},
    Flag{"tls-cert", "FILE", "Certificate chain (PEM); with --tls-key the server speaks https.",
         &set_text<&Config::tls_cert>, &show_text<&Config::tls_cert>},
    Flag{"tls-key", "FILE", "Private key of the certificate (PEM).",
         &set_text<&Config::tls_key>, &show_text<&Config::tls_key>},
    Flag{"announce", "URL", "Address to print for the page, where users know it by another than ours.",
         &set_text<&Config::announce>, nullptr},
    Flag{"config", "FILE", "File with a line `flag = value` for each flag; variables and flags win.",
         &set_text<&Config::config_file>, nullptr},
    Flag{"print-config", "", "Print the configuration in force and end.",
         &set_switch<&Config::print_config>, nullptr},
};

std::string variable_name(std::string_view flag) {
  std::string name = "TESSERA_";
  for (const char c : flag) {
    name += c == '-' ? '_' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  }
  return name;
}

const Flag* find_flag(std::string_view name) {
  const auto* found = std::find_if(kFlags.begin(), kFlags.end(),
                                   [name](const Flag& flag) { return flag.name == name; });
  return found == kFlags.end() ? nullptr : found;
}

Status set_flag(const Flag& flag, Config& config, std::string_view value, std::string where) {
  auto status = flag.set(config, value);
  if (!status) {
    Error error = status.error();
    error.where = std::move(where);
    return error;
  }
  return status;
}

Status apply_args(std::span<const std::string_view> args, Config& config) {
  for (std::size_t i = 0; i < args.size(); ++i) {
    std::string_view arg = args[i];
    if (arg.substr(0, 2) != "--") {
      return Error{ErrorCode::kInvalidArgument, "not a flag", std::string(arg)};
    }
    arg.remove_prefix(2);
    std::optional<std::string_view> value;
    if (const auto equals = arg.find('='); equals != std::string_view::npos) {
      value = arg.substr(equals + 1);
      arg = arg.substr(0, equals);
    }
    const std::string where = "--" + std::string(arg);
    const Flag* flag = find_flag(arg);
    if (flag == nullptr) {
      return Error{ErrorCode::kInvalidArgument, "unknown flag", where};
    }
    if (!value && flag->value.empty()) {
      value = "1";
    }
    if (!value) {
      if (++i == args.size()) {
        return Error{ErrorCode::kInvalidArgument, "needs a value", where};
      }
      value = args[i];
    }
    if (auto status = set_flag(*flag, config, *value, where); !status) {
      return status;
    }
  }
  return core::ok_status();
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  return first == std::string_view::npos
             ? std::string_view()
             : text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

/// `flag = value` on each line; `#` begins a line that is not read.
Status apply_file(const std::string& path, Config& config) {
  std::ifstream file(path);
  if (!file) {
    return Error{ErrorCode::kInvalidArgument, "cannot be read", path};
  }
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    const std::string_view text = trimmed(line);
    if (text.empty() || text.front() == '#') {
      continue;
    }
    const std::string where = path + ", line " + std::to_string(number);
    const auto equals = text.find('=');
    const std::string_view name = trimmed(text.substr(0, equals));
    const Flag* flag = find_flag(name);
    if (flag == nullptr || flag->show == nullptr) {
      return Error{ErrorCode::kInvalidArgument, "\"" + std::string(name) + "\" cannot be set here", where};
    }
    if (equals == std::string_view::npos) {
      return Error{ErrorCode::kInvalidArgument, "expected `flag = value`", where};
    }
    if (auto status = set_flag(*flag, config, trimmed(text.substr(equals + 1)), where); !status) {
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

}  // namespace

std::optional<std::string> process_environ(const std::string& name) {
  const char* value = std::getenv(name.c_str());  // NOLINT(concurrency-mt-unsafe): before threads.
  return value == nullptr ? std::nullopt : std::optional<std::string>(value);
}

core::Result<Config> parse_config(std::span<const std::string_view> args, const Environ& environ) {
  // Twice: the file comes first, but only the variables and flags say which it is.
  Config asked;
  if (auto status = apply_args(args, asked); !status) {
    return status.error();
  }
  Config config;
  config.config_file = asked.config_file.empty()
                           ? environ("TESSERA_CONFIG").value_or("")
                           : asked.config_file;
  if (!config.config_file.empty()) {
    if (auto status = apply_file(config.config_file, config); !status) {
      return status.error();
    }
  }
  for (const Flag& flag : kFlags) {
    const std::string name = variable_name(flag.name);
    if (const auto value = environ(name)) {
      if (auto status = set_flag(flag, config, *value, name); !status) {
        return status.error();
      }
    }
  }
  if (auto status = apply_args(args, config); !status) {
    return status.error();
  }
  if (config.data_dir.empty()) {
    config.data_dir = default_data_dir(environ);
  }
  return config;
}

std::string config_text(const Config& config) {
  std::string text = "# tessera serve; read with --config FILE\n";
  for (const Flag& flag : kFlags) {
    if (flag.show != nullptr) {
      const std::string value = flag.show(config);
      text += value == kHidden ? "# " : "";
      text += std::string(flag.name) + " = " + value + "\n";
    }
  }
  return text;
}

std::string config_help() {
  std::string text =
      "tessera serve: render jobs over HTTP\n\n"
      "Every flag has an environment variable; a flag wins over its variable, and that over the file of\n"
      "--config.\n\n";
  for (const Flag& flag : kFlags) {
    std::string head = "  --" + std::string(flag.name);
    if (!flag.value.empty()) {
      head += " " + std::string(flag.value);
    }
    head.resize(std::max<std::size_t>(head.size() + 2, 26), ' ');
    text += head + std::string(flag.text) + " [" + variable_name(flag.name) + "]\n";
  }
  return text;
}

std::string config_description() {
  using Json = nlohmann::ordered_json;
  Json options = Json::array();
  for (const Flag& flag : kFlags) {
    options.push_back({{"names", Json::array({"--" + std::string(flag.name)})},
                       {"value", flag.value},
                       {"text", flag.text},
                       {"variable", variable_name(flag.name)},
                       {"preset", ""},
                       {"repeats", false}});
  }
  options.push_back({{"names", Json::array({"-h", "--help"})}, {"value", ""}, {"text", "Print the flags"}});
  const Json line = {{"text", "Starts the service."}, {"operands", Json::array()}, {"options", std::move(options)}};
  return line.dump() + "\n";
}

bool is_loopback(std::string_view host) {
  if (host == "localhost" || host == "::1" || host == "[::1]") {
    return true;
  }
  // The whole of it has to be an address: 127.0.0.1.example.org is anybody's name.
  in_addr address = {};
  return ::inet_pton(AF_INET, std::string(host).c_str(), &address) == 1 &&
         (ntohl(address.s_addr) >> 24U) == 127;
}

}  // namespace server
