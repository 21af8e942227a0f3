#include "server/observe/log.h"

#include <array>
#include <cmath>
#include <cstdio>

#include "server/observe/clock.h"

namespace server {
namespace {

std::string_view level_name(LogLevel level) {
  switch (level) {
    case LogLevel::kDebug:
      return "debug";
    case LogLevel::kInfo:
      return "info";
    case LogLevel::kWarning:
      return "warning";
    case LogLevel::kError:
      return "error";
    case LogLevel::kOff:
      break;
  }
  return "off";
}

void append_string(std::string& line, std::string_view text) {
  line += '"';
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      line += '\\';
      line += c;
    } else if (byte < 0x20 || byte >= 0x7f) {
      std::array<char, 8> escape{};
      std::snprintf(escape.data(), escape.size(), "\\u%04x", static_cast<unsigned>(byte));
      line += escape.data();
    } else {
      line += c;
    }
  }
  line += '"';
}

void append_number(std::string& line, double value) {
  if (!std::isfinite(value)) {
    line += "null";
    return;
  }
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6g", value);
  line += text.data();
}

}  // namespace

std::string log_line(double unix_seconds, LogLevel level, std::string_view event,
                     std::initializer_list<LogField> fields) {
  std::array<char, 32> time{};
  std::snprintf(time.data(), time.size(), "%.3f", unix_seconds);
  std::string line = "{\"time\":" + std::string(time.data()) + ",\"level\":\"";
  line += level_name(level);
  line += "\",\"event\":";
  append_string(line, event);
  for (const LogField& field : fields) {
    line += ',';
    append_string(line, field.name);
    line += ':';
    if (const auto* text = std::get_if<std::string_view>(&field.value)) {
      append_string(line, *text);
    } else if (const auto* count = std::get_if<std::int64_t>(&field.value)) {
      line += std::to_string(*count);
    } else {
      append_number(line, *std::get_if<double>(&field.value));
    }
  }
  return line + "}";
}

void Log::write(LogLevel level, std::string_view event, std::initializer_list<LogField> fields) {
  if (!enabled(level)) {
    return;
  }
  write_line(log_line(unix_now(), level, event, fields));
}

void Log::write_line(std::string_view line) {
  const std::string whole = std::string(line) + "\n";
  const core::MutexLock lock(mutex_);
  std::fwrite(whole.data(), 1, whole.size(), stderr);
}

}  // namespace server
