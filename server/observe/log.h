/// Log: one JSON object a line on stderr: {"time", "level", "event", ...fields}.
#pragma once

#include <atomic>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <variant>

#include "core/base/mutex.h"
#include "server/config/config.h"

namespace server {

struct LogField {
  std::string_view name;
  std::variant<std::string_view, std::int64_t, double> value;
};

class Log {
 public:
  /// Lines below `level` are dropped.
  explicit Log(LogLevel level) : level_(level) {}

  bool enabled(LogLevel level) const { return level >= level_.load(); }
  void set_level(LogLevel level) { level_ = level; }
  /// event: one or two words that name the event; all variable data are fields.
  void write(LogLevel level, std::string_view event, std::initializer_list<LogField> fields);
  /// Writes a line made by log_line(), whatever its level.
  void write_line(std::string_view line);

 private:
  std::atomic<LogLevel> level_;
  core::Mutex mutex_;  ///< One line at a time.
};

/// Returns the line without its line break. Bytes that are not valid text are escaped.
std::string log_line(double unix_seconds, LogLevel level, std::string_view event,
                     std::initializer_list<LogField> fields);

}  // namespace server
