/// Wall-clock time in the API's unit.
#pragma once

#include <chrono>

namespace server {

inline constexpr double kDaySeconds = 24 * 3600;

/// Seconds since 1970.
inline double unix_now() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace server
