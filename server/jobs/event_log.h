/// EventLog: what happened to one job, numbered, for any number of readers that wait on it.
///
/// It is bounded by what it holds: every durable event (state, warning, end: few), the newest
/// progress, and for each tile the newest revision. A reader that fell behind therefore gets the
/// newest of everything and loses nothing that still matters.
///
/// Numbers start at 1. A durable event is stored before it is published: its number is reserved
/// first, and until it is published or dropped no reader sees a higher one.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include "api/events.h"
#include "core/base/mutex.h"

namespace server {

struct LoggedEvent {
  std::uint64_t seq = 0;
  api::EventType type = api::EventType::kState;
  std::string data;  ///< Of durable events; the others give the state at the time of reading.
  int tile = -1;     ///< Of kTile.
  std::uint32_t revision = 0;  ///< Of kTile.
};

class EventLog {
 public:
  using Deadline = std::chrono::steady_clock::time_point;

  /// Takes the next `count` numbers; the first is returned. Each must be given to publish(), or all
  /// to drop().
  std::uint64_t reserve(int count);
  /// Durable events with reserved numbers, in order.
  void publish(std::vector<LoggedEvent> events);
  void drop(std::uint64_t first, int count);

  void tile_changed(int tile, std::uint32_t revision);
  void progress_changed();

  /// The highest number that readers may see.
  std::uint64_t last_seq() const;
  std::optional<LoggedEvent> last_end() const;

  /// What is there after `seq`, in order; at most `tiles_max` tile events.
  std::vector<LoggedEvent> read_after(std::uint64_t seq, std::size_t tiles_max) const;

  /// What a waiting reader wants to be woken by.
  enum class Wake { kAnything, kDurable };
  /// Waits until there is something after `seq`; false at the deadline or when stopped.
  bool wait_after(std::uint64_t seq, Wake wake, Deadline deadline, std::stop_token stop) const;

 private:
  std::uint64_t visible_seq() const REQUIRES(mutex_);
  bool has_after(std::uint64_t seq, Wake wake) const REQUIRES(mutex_);

  mutable core::Mutex mutex_;
  mutable core::CondVar any_changed_;      ///< Waiters for anything.
  mutable core::CondVar durable_changed_;  ///< Those for durable events only.
  std::uint64_t next_seq_ GUARDED_BY(mutex_) = 1;
  std::set<std::uint64_t> reserved_ GUARDED_BY(mutex_);
  std::map<std::uint64_t, LoggedEvent> durable_ GUARDED_BY(mutex_);
  std::map<std::uint64_t, LoggedEvent> tiles_ GUARDED_BY(mutex_);
  std::map<int, std::uint64_t> seq_of_tile_ GUARDED_BY(mutex_);
  std::uint64_t progress_seq_ GUARDED_BY(mutex_) = 0;
};

}  // namespace server
