/// EventLog: the numbered events of one job, for any number of waiting readers.
///
/// Its size is bounded: it holds every durable event (state, warning, end: few), the newest
/// progress, and the newest revision of each tile. A reader that falls behind gets the newest of
/// each and loses nothing that still matters.
///
/// Numbers start at 1. A durable event is stored before it is published: its number is reserved
/// first, and until it is published or dropped no reader sees a higher number.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include "api/answers/events.h"
#include "core/base/mutex.h"

namespace server {

struct LoggedEvent {
  std::uint64_t seq = 0;
  api::EventType type = api::EventType::kState;
  std::string data;  ///< For durable events; the others take the state at the time of reading.
  int tile = -1;     ///< For kTile.
  std::uint32_t revision = 0;  ///< For kTile.
};

class EventLog {
 public:
  using Deadline = std::chrono::steady_clock::time_point;

  /// Reserves the next `count` numbers and returns the first. Each must be passed to publish(), or
  /// all to drop().
  std::uint64_t reserve(int count);
  /// Publishes durable events with reserved numbers, in order.
  void publish(std::vector<LoggedEvent> events);
  void drop(std::uint64_t first, int count);

  /// No effect if a newer revision of the tile was published before: a run that has left the job to
  /// another may publish its last one late.
  void tile_changed(int tile, std::uint32_t revision);
  void progress_changed();

  /// Returns the highest number that readers may see.
  std::uint64_t last_seq() const;
  std::optional<LoggedEvent> last_end() const;

  /// Returns the events after `seq`, in order; at most `tiles_max` tile events.
  std::vector<LoggedEvent> read_after(std::uint64_t seq, std::size_t tiles_max) const;

  /// Events that wake a waiting reader.
  enum class Wake { kAnything, kDurable };
  /// Waits for an event after `seq`. Returns false at the deadline or when stopped.
  bool wait_after(std::uint64_t seq, Wake wake, Deadline deadline, std::stop_token stop) const;

 private:
  std::uint64_t visible_seq() const REQUIRES(mutex_);
  bool has_after(std::uint64_t seq, Wake wake) const REQUIRES(mutex_);

  mutable core::Mutex mutex_;
  mutable core::CondVar any_changed_;      ///< For readers of all events.
  mutable core::CondVar durable_changed_;  ///< For readers of durable events only.
  std::uint64_t next_seq_ GUARDED_BY(mutex_) = 1;
  std::set<std::uint64_t> reserved_ GUARDED_BY(mutex_);
  std::map<std::uint64_t, LoggedEvent> durable_ GUARDED_BY(mutex_);
  std::map<std::uint64_t, LoggedEvent> tiles_ GUARDED_BY(mutex_);
  std::map<int, std::uint64_t> seq_of_tile_ GUARDED_BY(mutex_);
  std::uint64_t progress_seq_ GUARDED_BY(mutex_) = 0;
};

}  // namespace server
