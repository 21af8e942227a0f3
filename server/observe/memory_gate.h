/// MemoryGate: accounts for all large allocations before they are made.
///
/// One limit for all: films and scenes of jobs, scenes being decoded, dry runs, films and images of
/// requests, comparisons. A request that does not fit waits, or is refused with the figures. A
/// shared object (a scene) has a name and counts once. Cached objects that are not in use are
/// dropped when memory is short.
///
/// Tenants share the memory of requests. Freed memory goes first to the waiting tenant that holds
/// least. A tenant whose requests hold at most 1/64 of the limit may exceed it, all such tenants
/// together by 1/16: small requests do not wait for a tenant that holds everything.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "core/base/mutex.h"
#include "core/base/result.h"

namespace server {

struct MemoryUse {
  std::uint64_t bytes = 0;
  /// Bytes by name; holders of the same name share the memory.
  std::map<std::string, std::uint64_t> shared = {};
  /// The tenant whose request uses it; empty: the server itself, which no share binds.
  std::string tenant = {};
};

class MemoryGate {
  struct Room;

 public:
  static constexpr std::chrono::seconds kPatience{20};

  /// bytes_max: 0 for no limit.
  explicit MemoryGate(std::uint64_t bytes_max);

  /// Memory of one user, released by the destructor. May outlive the gate. For one thread at a
  /// time.
  class Lease {
   public:
    Lease() = default;
    Lease(Lease&& other) noexcept;
    Lease& operator=(Lease&& other) noexcept;
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    ~Lease();

    std::uint64_t bytes() const;
    /// Adds `bytes` of its own, waiting if necessary. Errors: of MemoryGate::take().
    core::Status grow(std::uint64_t bytes, std::chrono::milliseconds patience = kPatience);
    /// Reduces its own bytes to `bytes`; never increases them.
    void shrink_to(std::uint64_t bytes);

   private:
    friend class MemoryGate;
    Lease(std::shared_ptr<Room> room, std::uint64_t id) : room_(std::move(room)), id_(id) {}
    std::shared_ptr<Room> room_;
    std::uint64_t id_ = 0;
    std::string what_ = {};
  };

  /// Errors: kTooLarge when it would not fit into an idle server, kUnavailable when no memory
  /// became free in time; both with the figures. what: "the scene", for their text.
  core::Result<Lease> take(MemoryUse use, std::string_view what,
                           std::chrono::milliseconds patience = kPatience);
  core::Result<Lease> take(std::uint64_t bytes, std::string_view what,
                           std::chrono::milliseconds patience = kPatience) {
    return take(MemoryUse{.bytes = bytes}, what, patience);
  }
  /// Returns kTooLarge, with the figures, if so many bytes do not fit into an idle server: all that
  /// a request holds at the same time, including the film that it reads. what: as for take().
  core::Status check(std::uint64_t bytes, std::string_view what) const;
  /// Accounts for memory that is already allocated, beyond the limit if necessary. kIdle: held by a
  /// cache, whose reclaimer can release it.
  enum class Kind : std::uint8_t { kNeeded, kIdle };
  Lease note(MemoryUse use, Kind kind);

  enum class Fit : std::uint8_t {
    kYes,
    kWithoutIdle,  ///< Not before idle memory is dropped.
    kNo,
  };
  /// Changes the lease to this use if everything then fits into `most` (0: the gate's limit).
  Fit try_change(Lease& lease, const MemoryUse& use, std::uint64_t most = 0);
  /// Drops one idle object; returns false if there is none. Not to be called with a lock that a
  /// reclaimer takes.
  bool drop_one_idle();
  /// Returns whether try_change() would succeed once all idle memory is dropped.
  bool has_room(const Lease& lease, const MemoryUse& use, std::uint64_t most = 0) const;
  /// Changes the lease, beyond the limit if necessary.
  static void change(Lease& lease, const MemoryUse& use);

  /// Adds a reclaimer; they are called in this order. drop_one: releases one idle object; returns
  /// false when there is none. The gate must not be used after an object that a reclaimer uses is
  /// destroyed.
  void add_reclaimer(std::function<bool()> drop_one);

  std::uint64_t bytes_max() const { return bytes_max_; }
  /// Returns the limit for the first use of a tenant that holds nothing.
  std::uint64_t bytes_max_of_first(std::uint64_t bytes) const;
  std::uint64_t used_bytes() const;

 private:
  const std::uint64_t bytes_max_;
  const std::shared_ptr<Room> room_;
};

/// Formats bytes: "1.5 GB".
std::string memory_words(std::uint64_t bytes);

/// Bundles a value with the lease of its memory, so that they share a lifetime.
template <typename Value>
std::shared_ptr<Value> with_lease(std::shared_ptr<Value> value, MemoryGate::Lease lease) {
  struct Both {
    MemoryGate::Lease lease;  // destroyed last
    std::shared_ptr<Value> value;
  };
  auto both = std::make_shared<Both>(Both{.lease = std::move(lease), .value = std::move(value)});
  return {both, both->value.get()};
}

}  // namespace server
