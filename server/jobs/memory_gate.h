/// MemoryGate: requests that take much memory wait until there is room for them.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "core/base/mutex.h"
#include "core/base/result.h"

namespace server {

class MemoryGate {
  struct Room {
    core::Mutex mutex;
    core::CondVar freed;
    std::uint64_t used GUARDED_BY(mutex) = 0;
  };

 public:
  static constexpr std::chrono::seconds kPatience{20};

  explicit MemoryGate(std::uint64_t bytes_max) : bytes_max_(bytes_max) {}

  /// Bytes that somebody uses, given back with it. May outlive the gate.
  class Lease {
   public:
    Lease(Lease&& other) noexcept : room_(std::move(other.room_)), bytes_(other.bytes_) {}
    Lease& operator=(Lease&&) = delete;
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    ~Lease() {
      if (room_) {
        const core::MutexLock lock(room_->mutex);
        room_->used -= bytes_;
        room_->freed.notify_all();
      }
    }

   private:
    friend class MemoryGate;
    Lease(std::shared_ptr<Room> room, std::uint64_t bytes)
        : room_(std::move(room)), bytes_(bytes) {}
    std::shared_ptr<Room> room_;
    std::uint64_t bytes_;
  };

  /// Who is alone gets any number. Empty: no room now.
  std::optional<Lease> try_take(std::uint64_t bytes) {
    const core::MutexLock lock(room_->mutex);
    if (!has_room(bytes)) {
      return std::nullopt;
    }
    room_->used += bytes;
    return Lease(room_, bytes);
  }
  /// The same after waiting. Errors: kUnavailable.
  core::Result<Lease> take(std::uint64_t bytes, std::chrono::milliseconds patience = kPatience) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    const core::MutexLock lock(room_->mutex);
    while (!has_room(bytes)) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
          deadline - std::chrono::steady_clock::now());
      if (left.count() <= 0) {
        return core::Error{
            core::ErrorCode::kUnavailable,
            "requests for large pictures have all the memory that is meant for them; try again",
            ""};
      }
      static_cast<void>(room_->freed.wait_for(room_->mutex, left));
    }
    room_->used += bytes;
    return Lease(room_, bytes);
  }
  std::uint64_t used_bytes() const {
    const core::MutexLock lock(room_->mutex);
    return room_->used;
  }

 private:
  bool has_room(std::uint64_t bytes) const REQUIRES(room_->mutex) {
    return room_->used == 0 || room_->used + bytes <= bytes_max_;
  }

  const std::uint64_t bytes_max_;
  const std::shared_ptr<Room> room_ = std::make_shared<Room>();
};

}  // namespace server
