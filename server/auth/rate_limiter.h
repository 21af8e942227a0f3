/// RateLimiter: limits requests per minute for each key, by a token bucket.
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
    int limit = 0;      ///< Requests per minute.
    int remaining = 0;  ///< Requests allowed now.
    int reset_seconds =
        0;  ///< Until the bucket is full; after a refusal, until the next request is allowed.
    bool allowed = true;
  };

  /// Takes one token of `name`. Pre: per_minute > 0.
  State take(const std::string& name, int per_minute, Clock::time_point now = Clock::now());
  /// Returns the state after the last take(); empty for a name without a limit.
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
