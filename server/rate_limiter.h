/// RateLimiter: so many requests a minute for each key, as a bucket that fills steadily.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>

#include "core/base/mutex.h"

namespace server {

class RateLimiter {
 public:
  using Clock = std::chrono::steady_clock;

  struct State {
    int limit = 0;      ///< Requests a minute.
    int remaining = 0;  ///< That may be made at once.
    int reset_seconds =
        0;  ///< Until all of them may be made again; after a refusal until the next.
    bool allowed = true;
  };

  /// Counts one request of `name`. Pre: per_minute > 0.
  State take(const std::string& name, int per_minute, Clock::time_point now = Clock::now());
  /// As the last take() left it; empty for who is not limited.
  std::optional<State> last(const std::string& name) const;

 private:
  struct Bucket {
    double tokens = 0;
    Clock::time_point filled_at;
    State state;
  };
  mutable core::Mutex mutex_;
  std::map<std::string, Bucket> buckets_ GUARDED_BY(mutex_);
};

}  // namespace server
