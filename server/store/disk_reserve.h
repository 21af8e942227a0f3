/// DiskReserve: a file that reserves disk space. The space is released when the disk is full, so
/// that records can still be changed: jobs cancelled, failed, paused and deleted. Thread-safe.
#pragma once

#include <atomic>
#include <string>

#include "core/base/mutex.h"

namespace server {

class DiskReserve {
 public:
  /// path: created when the space is taken.
  explicit DiskReserve(std::string path) : path_(std::move(path)) {}

  /// Takes the space unless it is taken already. Returns false if the disk has too little.
  bool take();
  /// Releases the space. Returns true if there was any to release.
  bool give_up();
  bool is_taken() const { return is_taken_; }

  /// take() fails while an object of this class lives, so that no thread takes the space back
  /// before it was used.
  class Spending {
   public:
    explicit Spending(DiskReserve& reserve) : reserve_(reserve) { reserve_.is_spent_ = true; }
    ~Spending() { reserve_.is_spent_ = false; }
    Spending(const Spending&) = delete;
    Spending& operator=(const Spending&) = delete;

   private:
    DiskReserve& reserve_;
  };

 private:
  const std::string path_;
  core::Mutex mutex_;
  std::atomic<bool> is_taken_ = false;
  std::atomic<bool> is_spent_ = false;
};

}  // namespace server
