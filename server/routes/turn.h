/// Turn: serializes requests that need gigabytes of memory.
#pragma once

#include <chrono>
#include <mutex>
#include <string>
#include <utility>

#include "core/base/result.h"

namespace server {

class Turn {
 public:
  using Held = std::unique_lock<std::timed_mutex>;

  /// Waits a limited time for earlier requests. Errors: kUnavailable.
  core::Result<Held> take() {
    Held held(mutex_, kPatience);
    if (!held) {
      // In pieces: GCC 14 warns of a copy out of bounds in the sum of three strings.
      std::string message = "other requests were being served for ";
      message += std::to_string(kPatience.count());
      message += " s, and this request waited; try again";
      return core::Error{core::ErrorCode::kUnavailable, std::move(message), ""};
    }
    return held;
  }

 private:
  static constexpr std::chrono::seconds kPatience{20};
  std::timed_mutex mutex_;
};

}  // namespace server
