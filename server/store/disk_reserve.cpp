#include "server/store/disk_reserve.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>

#include <fcntl.h>
#include <unistd.h>

#include "server/store/files.h"

namespace server {
namespace {

/// Largest size of the database's write-ahead log before its pages are written to the database:
/// 1000 pages of 4096 bytes (wal_autocheckpoint). On a small file system, a sixteenth of it.
constexpr std::uint64_t kReserveBytesMax = std::uint64_t{4096} * 1000;
constexpr std::uint64_t kShare = 16;

}  // namespace

bool DiskReserve::take() {
  const core::MutexLock lock(mutex_);
  if (is_taken_) {
    return true;
  }
  if (is_spent_) {
    return false;
  }
  const auto space = disk_space(std::filesystem::path(path_).parent_path().string());
  const auto file = open_file(path_, O_RDWR | O_CREAT);
  if (!space || !file) {
    return false;
  }
  const std::uint64_t bytes = std::min(kReserveBytesMax, space->total_bytes / kShare);
  is_taken_ = bytes == 0 || ::posix_fallocate(file->get(), 0, static_cast<off_t>(bytes)) == 0;
  if (!is_taken_) {
    static_cast<void>(::ftruncate(file->get(), 0));  // Frees what was allocated before the failure.
  }
  return is_taken_;
}

bool DiskReserve::give_up() {
  const core::MutexLock lock(mutex_);
  const auto file = open_file(path_, O_RDWR);
  const auto bytes = file ? file_bytes(file->get(), path_) : core::Result<std::uint64_t>(0);
  is_taken_ = false;
  return bytes && *bytes > 0 && ::ftruncate(file->get(), 0) == 0;
}

}  // namespace server
