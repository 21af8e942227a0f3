#include "clients/cli/patience.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <utility>

namespace cli {

std::chrono::milliseconds Pauses::next(const ApiClient::Last& last) {
  // A server that is back is noticed within the pause that it asks for itself, server/http.
  constexpr std::chrono::milliseconds kMost{5000};
  const auto own = std::exchange(own_, std::min(2 * own_, kMost));
  const std::chrono::milliseconds asked =
      std::chrono::seconds(std::clamp<int>(last.retry_after_seconds, 0, 600));
  return std::max(own, asked);
}

bool wait(std::chrono::milliseconds time, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any changed;
  std::unique_lock lock(mutex);
  return !changed.wait_for(lock, stop, time, [&stop] { return stop.stop_requested(); });
}

}  // namespace cli
