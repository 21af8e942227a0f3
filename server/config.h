/// Config: everything an operator can set, from one table of flags.
///
/// Order: defaults, then environment variables TESSERA_<FLAG> (dashes become underscores), then
/// flags. Unknown flags and values out of range are refused with kInvalidArgument; `where` is the
/// flag or the variable.
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

struct Config {
  std::string listen = "127.0.0.1";
  int port = 8080;                 ///< 0: any free one
  std::string data_dir;            ///< empty: $XDG_DATA_HOME/tessera, else ~/.local/share/tessera
  int threads = 0;                 ///< render threads; 0: as many as the machine has
  std::string key;                 ///< bearer key; empty: none, which only loopback may have
  std::vector<std::string> hosts;  ///< names accepted in Host besides the loopback ones
  std::vector<std::string> origins;  ///< other origins that pages may call from (CORS)
  double grace_seconds = 10;       ///< from SIGTERM to the end
  LogLevel log_level = LogLevel::kInfo;
  bool demo = false;               ///< submit one demo job when the store has none yet

  int queue_max = 1000;            ///< jobs waiting; 429 beyond
  int running_max = 16;            ///< jobs that hold memory at a time
  int streams_max = 2048;          ///< open event and tile streams
  int samples_max = 65536;         ///< of any job: stop reason `limit`
  std::uint64_t upload_bytes_max = std::uint64_t{2} << 30U;
  std::uint64_t scene_cache_bytes = std::uint64_t{4} << 30U;
  std::uint64_t film_cache_bytes = std::uint64_t{512} << 20U;  ///< finished films kept in memory
  double checkpoint_seconds = 10;  ///< between checkpoints of a rendering job
  double disk_limit_percent = 80;  ///< of the disk; used when disk_limit_bytes is 0
  std::uint64_t disk_limit_bytes = 0;
};

/// Reads an environment variable; empty when it is not set.
using Environ = std::function<std::optional<std::string>(const std::string& name)>;
/// The process's own variables.
std::optional<std::string> process_environ(const std::string& name);

/// args: what follows the verb `serve`, without --help.
core::Result<Config> parse_config(std::span<const std::string_view> args, const Environ& environ);

/// One paragraph a flag, with its variable and default.
std::string config_help();
/// The same as one line of JSON, for completions and the manual page (clients/cli/verb_text.h).
std::string config_description();

/// True for 127.0.0.0/8, ::1 and localhost.
bool is_loopback(std::string_view host);

}  // namespace server
