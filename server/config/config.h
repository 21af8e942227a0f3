/// Config: all operator settings, from one table of flags.
///
/// Precedence, lowest first: defaults, the file named by --config, environment variables
/// TESSERA_<FLAG> (dashes become underscores), flags. Empty variables count as unset, and links of
/// services (tcp://...) are ignored with a warning. Unknown flags and values out of range are
/// refused with kInvalidArgument; `where` is the flag, the variable, or the file with its line.
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
  int port = 8080;                 ///< 0: any free one
  std::string data_dir;            ///< empty: $XDG_DATA_HOME/tessera, else ~/.local/share/tessera
  int threads = 0;                 ///< render threads; 0: as many as the machine has
  std::string isa = "native";      ///< for Embree: native, sse2 ... avx512, on arm64 neon
  std::string key;                 ///< bearer key with all rights; empty: none
  std::string key_file;            ///< file that `key` was read from
  std::string worker_key;          ///< bearer key with the scope `worker` only; empty: none
  std::string metrics_key;         ///< bearer key required by /metrics; empty: none
  std::vector<std::string> hosts;  ///< names accepted in Host besides the loopback names (origin.h)
  std::vector<std::string> origins;  ///< other origins whose pages may call the API (origin.h)
  std::vector<std::string> embed_origins;  ///< other origins whose pages may frame /embed/JOB
  double wait_max_seconds = 25;            ///< longest ?wait and Prefer: wait that is honoured
  double grace_seconds = 10;               ///< longest time from SIGTERM to exit
  LogLevel log_level = LogLevel::kInfo;
  bool shared = false;  ///< every key sees the objects of all tenants
  bool demo = false;    ///< submit a demo job when the store is empty

  int queue_max = 1000;            ///< jobs waiting; 429 beyond
  int running_max = 64;            ///< jobs that render concurrently
  Share memory = {.percent = 70};  ///< of usable_memory_bytes(), for all large allocations
  int streams_max = 2048;          ///< open event and tile streams
  int lab_runs_max = 2;            ///< concurrent experiments, one low-priority thread each
  int samples_max = 65536;         ///< of any job: stop reason `limit`
  std::uint64_t upload_bytes_max = std::uint64_t{2} << 30U;
  Share scene_cache = {.percent = 10};  ///< of usable_memory_bytes()
  Share film_cache = {.percent = 5};    ///< of the same, for films of finished jobs
  double checkpoint_seconds = 10;       ///< between checkpoints of a rendering job
  int retention_seconds = 0;            ///< of finished jobs; 0: for ever
  int ended_max = 0;                    ///< finished jobs kept; 0: any number
  Share disk_limit = {.percent = 80};   ///< of the disk, for assets and films

  int rate_limit = 6000;                  ///< requests per minute of each stored key; 0: any number
  int quota_jobs = 500;                   ///< unfinished jobs of each tenant; 0: any number
  int quota_previews = 16;                ///< concurrent previews of each tenant; 0: any number
  int quota_streams = 1024;               ///< open streams of each tenant; 0: any number
  int quota_lab_runs = 1;                 ///< concurrent experiments of each tenant; 0: any number
  Share quota_storage = {.percent = 50};  ///< of the disk limit, for each tenant; 0 bytes: no limit
  std::string audit_log;                  ///< file for audit lines; empty: they go to the log
  std::string webhook_secret;             ///< whsec_...; empty: the one in the data directory
  std::vector<std::string> converters;    ///< EXTENSION=PROGRAM
  int convert_seconds = 60;               ///< for one file of another format
  bool drake = false;                     ///< /render is /v1/drake/render, too
  bool webhook_private = false;           ///< webhooks may go to private addresses
  std::vector<std::string> trusted_proxies;  ///< networks whose X-Forwarded-* are trusted
  std::string tls_cert;                      ///< PEM; empty: plain HTTP
  std::string tls_key;                       ///< PEM

  std::string queue;           ///< NATS server from which workers take units; empty: no workers
  std::string queue_creds;     ///< file with user credentials for it; empty: none
  std::string queue_ca;        ///< PEM file that verifies its certificate
  int render_threads = 0;      ///< with a queue: local threads that also render units
  float verify_share = 0.01F;  ///< fraction of units rendered by two workers
  double lease_seconds = 15;   ///< of a unit whose worker makes no progress

  std::string announce;     ///< public address of the page; empty: the listen address
  std::string base_path;    ///< path below which a proxy places the server: "/render", or ""
  std::string config_file;  ///< the configuration file that was read
  bool print_config = false;
  std::vector<std::string> warnings;  ///< about variables that were ignored
};

/// Reads an environment variable; empty when it is not set.
using Environ = std::function<std::optional<std::string>(const std::string& name)>;
/// The process's own variables.
std::optional<std::string> process_environ(const std::string& name);

/// Returns `given` or, when it is empty, the default of `tessera serve`.
core::Result<std::string> data_directory(const std::string& given);

/// args: arguments of `serve`, without --help.
core::Result<Config> parse_config(std::span<const std::string_view> args, const Environ& environ);

/// Returns the effective configuration as text for --config, without secrets.
std::string config_text(const Config& config);

/// Returns the flags allowed in a configuration file whose values differ in `after`.
std::vector<std::string> changed_flags(const Config& before, const Config& after);

/// One paragraph for each flag, with its variable and default.
std::string config_help();
/// The same as one line of JSON, for completions and the manual page (clients/cli/verb_text.h).
std::string config_description();

/// Returns true for 127.0.0.0/8, ::1 and localhost.
bool is_loopback(std::string_view host);

}  // namespace server
