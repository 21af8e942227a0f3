/// Wall-clock time in the API's unit.
#pragma once

#include <chrono>

namespace server {

/// Seconds since 1970.
inline double unix_now() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace server
