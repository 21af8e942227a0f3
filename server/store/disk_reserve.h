/// DiskReserve: a file of nothing but space. It is given up when the disk is full, so that records
/// can still be changed: jobs cancelled, failed, paused and deleted. Thread-safe.
#pragma once

#include <atomic>
#include <string>

#include "core/base/mutex.h"

namespace server {

class DiskReserve {
 public:
  /// path: made when the space is taken.
  explicit DiskReserve(std::string path) : path_(std::move(path)) {}

  /// Takes the space unless it is taken. False: the disk has not that much.
  bool take();
  /// True: there was some to give.
  bool give_up();
  bool is_taken() const { return is_taken_; }

 private:
  const std::string path_;
  core::Mutex mutex_;
  std::atomic<bool> is_taken_ = false;
};

}  // namespace server
