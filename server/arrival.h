/// Arrival: a one-shot event to wait for. Thread-safe.
#pragma once

#include <atomic>
#include <chrono>
#include <stop_token>

#include "core/base/mutex.h"

namespace server {

class Arrival {
 public:
  void arrive() {
    const core::MutexLock lock(mutex_);
    has_come_ = true;
    came_.notify_all();
  }
  bool has_come() const { return has_come_; }
  /// Returns false when it did not arrive in time.
  bool wait(const std::stop_token& stop) {
    // As for callers that wait for memory (MemoryGate).
    constexpr std::chrono::seconds kPatience{20};
    const core::MutexLock lock(mutex_);
    came_.wait_for(mutex_, stop, kPatience, [this] { return has_come_.load(); });
    return has_come_;
  }

 private:
  core::Mutex mutex_;
  core::CondVar came_;
  std::atomic<bool> has_come_ = false;
};

}  // namespace server
