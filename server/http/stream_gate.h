/// StreamGate: limits open streams, in total and for each tenant, since each holds a thread.
///
/// The server takes the slot of a stream that a route returns. A route with a more specific error
/// than 503 takes it first: `StreamSlot slot = gate.try_enter(request.access.tenant); if (!slot)
/// return overloaded();`
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>

#include "core/base/mutex.h"
#include "server/http/message.h"

namespace server {

/// Most bytes that the system keeps for a client that does not read: the limit that connections set
/// (kUnsentLowBytes in connection.cpp), and the segment that is being filled; measured: 52 kB.
inline constexpr std::uint64_t kUnsentBytes = std::uint64_t{64} << 10U;

class StreamGate {
 public:
  /// limit: most open streams, at least 1. limit_of_owner: for each tenant; 0: any number.
  /// on_change: called with the number of open streams, one call at a time; must return at once.
  explicit StreamGate(int limit, int limit_of_owner = 0, std::function<void(int)> on_change = {})
      : limit_(limit), limit_of_owner_(limit_of_owner), on_change_(std::move(on_change)) {}
  StreamGate(const StreamGate&) = delete;
  StreamGate& operator=(const StreamGate&) = delete;

  /// owner: a tenant; empty: the operator, whom only the total limit binds. Returns an empty slot
  /// when all are taken. The gate must outlive its slots.
  StreamSlot try_enter(const std::string& owner = {});
  int open_count() const {
    const core::MutexLock lock(mutex_);
    return open_count_;
  }
  /// Time between two polls of a stream: longer for each open one, to bound the total cost.
  std::chrono::microseconds pace(std::chrono::microseconds alone) const {
    constexpr std::chrono::microseconds kForEach{500};
    return alone + kForEach * open_count();
  }
  int open_count_of(const std::string& owner) const {
    const core::MutexLock lock(mutex_);
    const auto found = of_owner_.find(owner);
    return found == of_owner_.end() ? 0 : found->second;
  }
  int limit() const { return limit_; }
  int limit_of_owner() const { return limit_of_owner_; }

 private:
  friend class StreamSlot;
  void leave(const std::string& owner);
  void count(int more) REQUIRES(mutex_);

  const int limit_;
  const int limit_of_owner_;
  const std::function<void(int)> on_change_;
  mutable core::Mutex mutex_;
  int open_count_ GUARDED_BY(mutex_) = 0;
  std::map<std::string, int> of_owner_ GUARDED_BY(mutex_);
};

}  // namespace server
