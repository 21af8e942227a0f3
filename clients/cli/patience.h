/// Repeats a request to a server that is unreachable, busy, restarting or out of space.
#pragma once

#include <chrono>
#include <stop_token>

#include "clients/cli/api_client.h"

namespace cli {

/// A request that has failed for this long is given up: longer than a server takes to restart on
/// another machine, so that no result is lost to it.
inline constexpr std::chrono::minutes kPatience{10};

/// Pauses between attempts of a request. Each is twice the previous one: a busy server gets few
/// requests, and a short outage costs little.
class Pauses {
 public:
  /// Returns at least the pause that the latest response asked for (Retry-After).
  std::chrono::milliseconds next(const ApiClient::Last& last);
  void reset() { own_ = kFirst; }

 private:
  static constexpr std::chrono::milliseconds kFirst{200};
  std::chrono::milliseconds own_ = kFirst;
};

/// Returns false at once when stopped.
bool wait(std::chrono::milliseconds time, const std::stop_token& stop);

/// Calls request() until it succeeds, fails for good, or has been unavailable for kPatience; stops
/// waiting when stopped. Returns its last result.
template <typename Request>
auto keep_trying(const ApiClient& server, const std::stop_token& stop, Request&& request) {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  Pauses pauses;
  while (true) {
    auto result = request();
    const bool may_help = !result && result.error().code == core::ErrorCode::kUnavailable &&
                          std::chrono::steady_clock::now() < end;
    if (!may_help || !wait(pauses.next(server.last()), stop)) {
      return result;
    }
  }
}

}  // namespace cli
