/// Config: everything an operator can set, from one table of flags.
///
/// Order: defaults, then the file that --config names, then environment variables TESSERA_<FLAG>
/// (dashes become underscores), then flags. Unknown flags and values out of range are refused with
/// kInvalidArgument; `where` is the flag, the variable, or the file with its line.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"

namespace server {

enum class LogLevel { kDebug, kInfo, kWarning, kError, kOff };

/// A percentage of something, or bytes when `percent` is 0.
struct Share {
  double percent = 0;
  std::uint64_t bytes = 0;
};

struct Config {
  std::string listen = "127.0.0.1";
  int port = 8080;                   ///< 0: any free one
  std::string data_dir;              ///< empty: $XDG_DATA_HOME/tessera, else ~/.local/share/tessera
  int threads = 0;                   ///< render threads; 0: as many as the machine has
  std::string isa = "native";        ///< what Embree is held to: native, sse2 ... avx512
  std::string key;                   ///< bearer key with all rights; empty: none
  std::string key_file;              ///< that `key` was read from
  std::string metrics_key;           ///< bearer key that /metrics needs; empty: none
  std::vector<std::string> hosts;    ///< names accepted in Host besides the loopback ones
  std::vector<std::string> origins;  ///< other origins that pages may call from (CORS)
  double grace_seconds = 10;         ///< from SIGTERM to the end
  LogLevel log_level = LogLevel::kInfo;
  bool shared = false;  ///< every key sees what the others make
  bool demo = false;    ///< submit one demo job when the store has none yet

  int queue_max = 1000;            ///< jobs waiting; 429 beyond
  int running_max = 16;            ///< jobs that render at a time
  Share memory = {.percent = 70};  ///< of usable_memory_bytes(), for all that takes it
  int streams_max = 2048;          ///< open event and tile streams
  int lab_runs_max = 2;            ///< experiments at a time, one thread of low priority each
  int samples_max = 65536;         ///< of any job: stop reason `limit`
  std::uint64_t upload_bytes_max = std::uint64_t{2} << 30U;
  Share scene_cache = {.percent = 10};  ///< of usable_memory_bytes()
  Share film_cache = {.percent = 5};    ///< of the same, for films of ended jobs
  double checkpoint_seconds = 10;       ///< between checkpoints of a rendering job
  int retention_seconds = 0;            ///< of jobs that have ended; 0: for ever
  int ended_max = 0;                    ///< jobs that have ended and are kept; 0: any number
  Share disk_limit = {.percent = 80};   ///< of the disk, for assets and films

  int rate_limit = 6000;                  ///< requests a minute of each stored key; 0: any number
  int quota_jobs = 500;                   ///< unfinished jobs of each tenant; 0: any number
  int quota_previews = 16;                ///< previews at a time of each tenant; 0: any number
  int quota_streams = 1024;               ///< open streams of each tenant; 0: any number
  int quota_lab_runs = 1;                 ///< experiments at a time of each tenant; 0: any number
  Share quota_storage = {.percent = 50};  ///< of the disk limit, for each tenant; 0 bytes: no limit
  std::string audit_log;                  ///< file for audit lines; empty: the log has them
  std::string webhook_secret;             ///< whsec_...; empty: the data directory has one
  bool webhook_private = false;           ///< webhooks may go to private addresses
  std::vector<std::string> trusted_proxies;  ///< networks whose X-Forwarded-* are believed
  std::string tls_cert;                      ///< PEM; empty: plain HTTP
  std::string tls_key;                       ///< PEM

  std::string queue;           ///< NATS server that workers take units from; empty: no workers
  std::string queue_creds;     ///< file with the credentials of a user of it; empty: none
  std::string queue_ca;        ///< PEM file that its certificate is checked with
  int render_threads = 0;      ///< with a queue: threads that also render what workers can
  float verify_share = 0.01F;  ///< of the units, that two workers render
  double lease_seconds = 15;   ///< of a unit whose worker makes no progress

  std::string announce;     ///< address of the page as its users know it; empty: as it is
  std::string config_file;  ///< that was read
  bool print_config = false;
};

/// Reads an environment variable; empty when it is not set.
using Environ = std::function<std::optional<std::string>(const std::string& name)>;
/// The process's own variables.
std::optional<std::string> process_environ(const std::string& name);

/// `given`, or where `tessera serve` looks when it is empty.
core::Result<std::string> data_directory(const std::string& given);

/// args: what follows the verb `serve`, without --help.
core::Result<Config> parse_config(std::span<const std::string_view> args, const Environ& environ);

/// The configuration in force as the text of a file for --config. Secrets are not shown.
std::string config_text(const Config& config);

/// Names of the flags that may stand in a configuration file and have other values in `after`.
std::vector<std::string> changed_flags(const Config& before, const Config& after);

/// One paragraph a flag, with its variable and default.
std::string config_help();
/// The same as one line of JSON, for completions and the manual page (clients/cli/verb_text.h).
std::string config_description();

/// True for 127.0.0.0/8, ::1 and localhost.
bool is_loopback(std::string_view host);

}  // namespace server
