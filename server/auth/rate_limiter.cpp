#include "server/auth/rate_limiter.h"

#include <algorithm>
#include <cmath>

namespace server {

RateLimiter::State RateLimiter::take(const std::string& name, int per_minute,
                                     Clock::time_point now) {
  const core::MutexLock lock(mutex_);
  const auto [found, is_new] = buckets_.try_emplace(name);
  Bucket& bucket = found->second;
  const double per_second = per_minute / 60.0;
  const double capacity = per_minute;
  if (is_new) {
    bucket.tokens = capacity;
  } else {
    const double waited = std::chrono::duration<double>(now - bucket.filled_at).count();
    bucket.tokens = std::min(capacity, bucket.tokens + waited * per_second);
  }
  bucket.filled_at = now;
  State& state = bucket.state;
  state.limit = per_minute;
  state.allowed = bucket.tokens >= 1;
  if (state.allowed) {
    bucket.tokens -= 1;
  }
  state.remaining = static_cast<int>(bucket.tokens);
  const double missing = state.allowed ? capacity - bucket.tokens : 1 - bucket.tokens;
  state.reset_seconds = std::max(1, static_cast<int>(std::ceil(missing / per_second)));
  return state;
}

std::optional<RateLimiter::State> RateLimiter::last(const std::string& name) const {
  const core::MutexLock lock(mutex_);
  const auto found = buckets_.find(name);
  return found == buckets_.end() ? std::nullopt : std::optional<State>(found->second.state);
}

}  // namespace server
