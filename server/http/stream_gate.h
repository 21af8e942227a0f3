/// Counts open streams against a limit. Each holds a thread, so there must be one.
///
/// A route that can say more than 503 takes its place first:
/// `StreamSlot slot = gate.try_enter(); if (!slot) return overloaded();`
#pragma once

#include <atomic>

#include "server/http/message.h"

namespace server {

class StreamGate {
 public:
  /// limit: the most streams open at a time, at least 1.
  explicit StreamGate(int limit) : limit_(limit) {}
  StreamGate(const StreamGate&) = delete;
  StreamGate& operator=(const StreamGate&) = delete;

  /// An empty slot when all places are taken. The gate must outlive its slots.
  StreamSlot try_enter();
  int open_count() const { return open_count_.load(std::memory_order_relaxed); }
  int limit() const { return limit_; }

 private:
  friend class StreamSlot;
  void leave() { open_count_.fetch_sub(1, std::memory_order_relaxed); }

  const int limit_;
  std::atomic<int> open_count_ = 0;
};

}  // namespace server
