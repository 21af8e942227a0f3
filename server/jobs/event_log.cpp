#include "server/jobs/event_log.h"

#include <algorithm>
#include <utility>

namespace server {

std::uint64_t EventLog::reserve(int count) {
  const core::MutexLock lock(mutex_);
  const std::uint64_t first = next_seq_;
  for (int i = 0; i < count; ++i) {
    reserved_.insert(next_seq_++);
  }
  return first;
}

void EventLog::publish(std::vector<LoggedEvent> events) {
  {
    const core::MutexLock lock(mutex_);
    for (LoggedEvent& event : events) {
      reserved_.erase(event.seq);
      const std::uint64_t seq = event.seq;
      durable_.emplace(seq, std::move(event));
    }
  }
  any_changed_.notify_all();
  durable_changed_.notify_all();
}

void EventLog::drop(std::uint64_t first, int count) {
  {
    const core::MutexLock lock(mutex_);
    for (int i = 0; i < count; ++i) {
      reserved_.erase(first + static_cast<std::uint64_t>(i));
    }
  }
  any_changed_.notify_all();
}

void EventLog::tile_changed(int tile, std::uint32_t revision) {
  {
    const core::MutexLock lock(mutex_);
    const auto known = seq_of_tile_.find(tile);
    if (known != seq_of_tile_.end() && revision <= tiles_.at(known->second).revision) {
      return;
    }
    const std::uint64_t seq = next_seq_++;
    const auto [place, is_new] = seq_of_tile_.emplace(tile, seq);
    if (!is_new) {
      // Reuses the map node under its new number: no allocation while rendering.
      auto node = tiles_.extract(place->second);
      node.key() = seq;
      node.mapped().seq = seq;
      node.mapped().revision = revision;
      tiles_.insert(tiles_.end(), std::move(node));
      place->second = seq;
    } else {
      LoggedEvent event;
      event.seq = seq;
      event.type = api::EventType::kTile;
      event.tile = tile;
      event.revision = revision;
      tiles_.emplace_hint(tiles_.end(), seq, std::move(event));
    }
  }
  any_changed_.notify_all();
}

void EventLog::progress_changed() {
  {
    const core::MutexLock lock(mutex_);
    progress_seq_ = next_seq_++;
  }
  any_changed_.notify_all();
}

std::uint64_t EventLog::visible_seq() const {
  return (reserved_.empty() ? next_seq_ : *reserved_.begin()) - 1;
}

std::uint64_t EventLog::last_seq() const {
  const core::MutexLock lock(mutex_);
  return visible_seq();
}

std::optional<LoggedEvent> EventLog::last_end() const {
  const core::MutexLock lock(mutex_);
  for (auto event = durable_.rbegin(); event != durable_.rend(); ++event) {
    if (event->second.type == api::EventType::kEnd) {
      return event->second;
    }
  }
  return std::nullopt;
}

std::vector<LoggedEvent> EventLog::read_after(std::uint64_t seq, std::size_t tiles_max) const {
  const core::MutexLock lock(mutex_);
  std::uint64_t visible = visible_seq();
  std::vector<LoggedEvent> events;
  for (auto tile = tiles_.upper_bound(seq); tile != tiles_.end() && tile->first <= visible;
       ++tile) {
    if (events.size() == tiles_max) {
      visible = events.back().seq;  // Returns no event beyond the last tile returned, so that the
                                    // reader skips no number.
      break;
    }
    events.push_back(tile->second);
  }
  for (auto event = durable_.upper_bound(seq); event != durable_.end() && event->first <= visible;
       ++event) {
    events.push_back(event->second);
  }
  if (progress_seq_ > seq && progress_seq_ <= visible) {
    LoggedEvent progress;
    progress.seq = progress_seq_;
    progress.type = api::EventType::kProgress;
    events.push_back(std::move(progress));
  }
  std::sort(events.begin(), events.end(),
            [](const LoggedEvent& a, const LoggedEvent& b) { return a.seq < b.seq; });
  return events;
}

bool EventLog::has_after(std::uint64_t seq, Wake wake) const {
  const std::uint64_t visible = visible_seq();
  const auto durable = durable_.upper_bound(seq);
  if (durable != durable_.end() && durable->first <= visible) {
    return true;
  }
  if (wake == Wake::kDurable) {
    return false;
  }
  const auto tile = tiles_.upper_bound(seq);
  return (tile != tiles_.end() && tile->first <= visible) ||
         (progress_seq_ > seq && progress_seq_ <= visible);
}

bool EventLog::wait_after(std::uint64_t seq, Wake wake, Deadline deadline,
                          std::stop_token stop) const {
  core::CondVar& changed = wake == Wake::kAnything ? any_changed_ : durable_changed_;
  const core::MutexLock lock(mutex_);
  // The predicate runs with the lock held, which the thread-safety analysis cannot see.
  const auto ready = [&]() TESSERA_TS(no_thread_safety_analysis) { return has_after(seq, wake); };
  return changed.wait_until(mutex_, std::move(stop), deadline, ready);
}

}  // namespace server
