/// Turn: work that takes gigabytes is done by one request at a time.
#pragma once

#include <chrono>
#include <mutex>
#include <string>

#include "core/base/result.h"

namespace server {

class Turn {
 public:
  using Held = std::unique_lock<std::timed_mutex>;

  /// Waits for those before, not for ever. Errors: kUnavailable.
  core::Result<Held> take() {
    Held held(mutex_, kPatience);
    if (!held) {
      return core::Error{core::ErrorCode::kUnavailable,
                         "others were being served for " + std::to_string(kPatience.count()) +
                             " s, and this request waited; try again",
                         ""};
    }
    return held;
  }

 private:
  static constexpr std::chrono::seconds kPatience{20};
  std::timed_mutex mutex_;
};

}  // namespace server
