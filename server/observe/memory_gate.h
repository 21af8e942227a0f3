/// MemoryGate: whatever takes much memory asks here first.
///
/// One number for all: films and scenes of jobs, scenes that are read and decoded, dry runs, films
/// and pictures of requests, comparisons. What does not fit waits, or is refused with the numbers.
/// What several hold together (a scene) has a name and counts once. What caches hold and nobody
/// needs goes when there is no room.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/mutex.h"
#include "core/base/result.h"

namespace server {

struct MemoryUse {
  std::uint64_t bytes = 0;
  /// By what names it: holders of the same name hold it together.
  std::map<std::string, std::uint64_t> shared = {};
};

class MemoryGate {
  struct Room;

 public:
  static constexpr std::chrono::seconds kPatience{20};

  /// bytes_max: 0 for any number.
  explicit MemoryGate(std::uint64_t bytes_max);

  /// What somebody uses, given back with it. May outlive the gate. One thread at a time.
  class Lease {
   public:
    Lease() = default;
    Lease(Lease&& other) noexcept;
    Lease& operator=(Lease&& other) noexcept;
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    ~Lease();

    std::uint64_t bytes() const;
    /// So much more of its own, after waiting. Errors: of MemoryGate::take().
    core::Status grow(std::uint64_t bytes, std::chrono::milliseconds patience = kPatience);
    /// So many bytes of its own, no more than before.
    void shrink_to(std::uint64_t bytes);

   private:
    friend class MemoryGate;
    Lease(std::shared_ptr<Room> room, std::uint64_t id) : room_(std::move(room)), id_(id) {}
    std::shared_ptr<Room> room_;
    std::uint64_t id_ = 0;
    std::string what_ = {};
  };

  /// Errors: kTooLarge when it would not fit into an empty server, kUnavailable when there was no
  /// room in time; both with the numbers. what: "the scene", for their text.
  core::Result<Lease> take(MemoryUse use, std::string_view what,
                           std::chrono::milliseconds patience = kPatience);
  core::Result<Lease> take(std::uint64_t bytes, std::string_view what,
                           std::chrono::milliseconds patience = kPatience) {
    return take(MemoryUse{.bytes = bytes}, what, patience);
  }
  /// For what is there already: beyond the limit if need be. idle: a cache has it, whose reclaimer
  /// lets it go.
  enum class Kind : std::uint8_t { kNeeded, kIdle };
  Lease note(MemoryUse use, Kind kind);

  /// Makes the lease one of this use, if all is then within `most` (0: within the gate) after what
  /// is idle went.
  bool try_change(Lease& lease, const MemoryUse& use, std::uint64_t most = 0);
  /// Would it, if all that is idle went?
  bool has_room(const Lease& lease, const MemoryUse& use, std::uint64_t most = 0) const;
  /// The same, beyond the limit if need be.
  static void change(Lease& lease, const MemoryUse& use);

  /// drop_one: lets one thing go that is held idle; false: there is none. Asked in this order. The
  /// gate is not used after what it reaches.
  void add_reclaimer(std::function<bool()> drop_one);

  std::uint64_t bytes_max() const { return bytes_max_; }
  std::uint64_t used_bytes() const;

 private:
  const std::uint64_t bytes_max_;
  const std::shared_ptr<Room> room_;
};

/// "1.5 GB"
std::string memory_words(std::uint64_t bytes);

/// The value with what it takes: whoever has the one has the other.
template <typename Value>
std::shared_ptr<Value> with_lease(std::shared_ptr<Value> value, MemoryGate::Lease lease) {
  struct Both {
    MemoryGate::Lease lease;  // goes last
    std::shared_ptr<Value> value;
  };
  auto both = std::make_shared<Both>(Both{.lease = std::move(lease), .value = std::move(value)});
  return {both, both->value.get()};
}

}  // namespace server
