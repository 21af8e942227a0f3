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

 private:
  const std::string path_;
  core::Mutex mutex_;
  std::atomic<bool> is_taken_ = false;
};

}  // namespace server
