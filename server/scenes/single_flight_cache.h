/// SingleFlightCache: a cache of expensive values, limited in bytes, that makes each value once.
///
/// The first caller makes the value; concurrent callers wait for it and share the result or error.
/// Errors are not cached. A caller whose stop token ends its wait, or its making of the value, gets
/// kCancelled; one of those who still wait then makes the value. Least recently used values are
/// dropped first; a value in use stays alive outside the cache. A value larger than the whole cache
/// is kept alone, or not at all.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>

#include "core/base/mutex.h"
#include "core/base/result.h"

namespace server {

template <typename Value>
class SingleFlightCache {
 public:
  using Pointer = std::shared_ptr<const Value>;
  struct Made {
    Pointer value;
    std::uint64_t bytes = 0;
  };

  enum class Oversized : std::uint8_t { kKept, kNotKept };

  explicit SingleFlightCache(std::uint64_t bytes_max, Oversized oversized = Oversized::kKept)
      : bytes_max_(bytes_max), oversized_(oversized) {}

  /// make: () -> core::Result<Made>; called without a lock, at most once at a time for each key. It
  /// ends with kCancelled soon after a stop is requested.
  template <typename Make>
  core::Result<Pointer> get(const std::string& key, const Make& make,
                            const std::stop_token& stop = {}) {
    std::shared_ptr<Flight> flight;
    {
      const core::MutexLock lock(mutex_);
      while (!flight) {
        if (const auto found = entries_.find(key); found != entries_.end()) {
          order_.splice(order_.begin(), order_, found->second.place);
          return found->second.value;
        }
        if (const auto running = flights_.find(key); running != flights_.end()) {
          const std::shared_ptr<Flight> other = running->second;
          landed_.wait(mutex_, stop, [&other] { return other->result.has_value(); });
          if (!other->result) {
            return core::Error{core::ErrorCode::kCancelled, "stopped while waiting", ""};
          }
          if (*other->result || other->result->error().code != core::ErrorCode::kCancelled) {
            return *other->result;
          }
          continue;  // Who made it was stopped.
        }
        flight = std::make_shared<Flight>();
        flights_[key] = flight;
      }
    }
    try {
      core::Result<Made> made = make();
      land(key, *flight, made);
    } catch (...) {
      land(key, *flight, core::Error{core::ErrorCode::kInternal, "not enough memory", ""});
      throw;
    }
    const core::MutexLock lock(mutex_);
    return *flight->result;
  }

  /// Returns the value if it is present.
  Pointer peek(const std::string& key) const {
    const core::MutexLock lock(mutex_);
    const auto found = entries_.find(key);
    return found == entries_.end() ? nullptr : found->second.value;
  }

  /// Inserts a value, replacing an older one.
  void put(const std::string& key, Made made) {
    const core::MutexLock lock(mutex_);
    insert(key, std::move(made));
  }

  /// Removes all keys with this prefix.
  void erase_prefix(const std::string& prefix) {
    const core::MutexLock lock(mutex_);
    auto entry = entries_.lower_bound(prefix);
    while (entry != entries_.end() && entry->first.compare(0, prefix.size(), prefix) == 0) {
      entry = drop(entry);
    }
  }

  /// Drops the least recently used value without other holders. Returns false when there is none.
  bool drop_unused() {
    const core::MutexLock lock(mutex_);
    for (auto key = order_.rbegin(); key != order_.rend(); ++key) {
      if (const auto entry = entries_.find(*key); entry->second.value.use_count() == 1) {
        drop(entry);
        return true;
      }
    }
    return false;
  }

  std::size_t count() const {
    const core::MutexLock lock(mutex_);
    return entries_.size();
  }
  std::uint64_t bytes() const {
    const core::MutexLock lock(mutex_);
    return bytes_;
  }

 private:
  struct Flight {
    std::optional<core::Result<Pointer>> result;
  };
  struct Entry {
    Pointer value;
    std::uint64_t bytes = 0;
    std::list<std::string>::iterator place;
  };
  using Entries = std::map<std::string, Entry>;

  void land(const std::string& key, Flight& flight, core::Result<Made> made) {
    {
      const core::MutexLock lock(mutex_);
      flights_.erase(key);
      if (made) {
        flight.result = core::Result<Pointer>(made->value);
        insert(key, std::move(*made));
      } else {
        flight.result = core::Result<Pointer>(made.error());
      }
    }
    landed_.notify_all();
  }

  void insert(const std::string& key, Made made) REQUIRES(mutex_) {
    if (const auto old = entries_.find(key); old != entries_.end()) {
      drop(old);
    }
    if (made.bytes > bytes_max_ && oversized_ == Oversized::kNotKept) {
      return;  // It would push out all others for nothing.
    }
    order_.push_front(key);
    bytes_ += made.bytes;
    entries_[key] =
        Entry{.value = std::move(made.value), .bytes = made.bytes, .place = order_.begin()};
    while (bytes_ > bytes_max_ && order_.size() > 1) {
      drop(entries_.find(order_.back()));
    }
  }

  typename Entries::iterator drop(typename Entries::iterator entry) REQUIRES(mutex_) {
    bytes_ -= entry->second.bytes;
    order_.erase(entry->second.place);
    return entries_.erase(entry);
  }

  const std::uint64_t bytes_max_;
  const Oversized oversized_;
  mutable core::Mutex mutex_;
  core::CondVar landed_;
  std::map<std::string, std::shared_ptr<Flight>> flights_ GUARDED_BY(mutex_);
  Entries entries_ GUARDED_BY(mutex_);
  std::list<std::string> order_ GUARDED_BY(mutex_);  ///< Most recently used first.
  std::uint64_t bytes_ GUARDED_BY(mutex_) = 0;
};

}  // namespace server
