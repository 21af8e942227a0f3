// Short texts with their own grammar: ids, and the Prefer header.

#include <algorithm>
#include <charconv>

#include "api/json/limits.h"
#include "api/json/values.h"
#include "api/requests.h"
#include "core/base/text.h"

namespace api {

std::optional<int> prefer_wait_seconds(std::string_view prefer_header) {
  const auto trim = [](std::string_view text) { return core::trimmed(text, " \t"); };
  while (!prefer_header.empty()) {
    const std::size_t end = std::min(prefer_header.find(','), prefer_header.size());
    std::string_view preference = trim(prefer_header.substr(0, end));
    prefer_header.remove_prefix(std::min(end + 1, prefer_header.size()));
    preference = trim(preference.substr(0, preference.find(';')));
    const std::size_t equals = preference.find('=');
    const std::string_view name = trim(preference.substr(0, equals));
    if (!core::equal_ignoring_case(name, "wait") || equals == std::string_view::npos) {
      continue;
    }
    std::string_view value = trim(preference.substr(equals + 1));
    if (value.size() >= 2 && value.front() == '"' && value.back() == '"') {
      value = value.substr(1, value.size() - 2);
    }
    std::int64_t seconds = 0;
    const auto read = std::from_chars(value.data(), value.data() + value.size(), seconds);
    if (value.empty() || read.ptr != value.data() + value.size() || seconds < 0) {
      return {};
    }
    // A number that does not fit in 64 bits exceeds the limit too.
    return static_cast<int>(read.ec == std::errc::result_out_of_range
                                ? limits::kWaitSeconds
                                : std::min(seconds, limits::kWaitSeconds));
  }
  return {};
}

bool is_uuid(std::string_view text) {
  constexpr std::size_t kLength = 36;
  if (text.size() != kLength) {
    return false;
  }
  for (std::size_t i = 0; i < kLength; ++i) {
    const bool is_dash = i == 8 || i == 13 || i == 18 || i == 23;
    if (is_dash ? text[i] != '-' : core::hex_digit(text[i]) < 0) {
      return false;
    }
  }
  return true;
}

bool expect_uuid(const std::string& text, std::string_view kind, const std::string& pointer,
                 Faults& faults) {
  if (is_uuid(text)) {
    return true;
  }
  faults.add(pointer, shown(Json(text)) + " is not a " + std::string(kind) + " id (UUID)");
  return false;
}

bool is_sha256(std::string_view text) {
  constexpr std::size_t kLength = 64;
  return text.size() == kLength && std::all_of(text.begin(), text.end(), [](char c) {
           return core::hex_digit(c) >= 0 && c == core::to_lower(c);
         });
}

}  // namespace api
