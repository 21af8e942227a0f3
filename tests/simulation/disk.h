/// Disk: the files of one folder as a machine keeps them that may lose its power.
///
/// Files are real, below a root on a file system in memory. Each change is kept apart until a sync
/// makes it durable; a power failure takes back any part of what was not synced: sectors of writes,
/// and names, of which the later ones are lost first, as in a journal of a file system. A sync of a
/// new file also makes its name durable, as ext4, XFS and Btrfs do. disk.cpp replaces the C
/// library's functions.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "tests/simulation/executor.h"

namespace simulation {

struct DiskFaults {
  std::uint64_t seed = 0;
  /// The process ends at that operation, counted from 1; 0: at none of its own.
  std::uint64_t end_at = 0;
  bool ends = false;          ///< The process ends at operations as kKilled or kPowerLost strikes.
  bool loses_power = false;   ///< Then, not only the process.
  Nanoseconds sync_mean = 0;  ///< Mean duration of a sync, and of freeing space.
  /// Called when the process is to end; must not return.
  std::function<void()> end = {};
};

/// Replaces the files below `root` from now on. Once per process.
void use_disk(const std::string& root, DiskFaults faults);
/// Takes back a part of what was not synced.
void lose_power();
/// Cuts real files to the sizes that they tell, before the process ends.
void shorten_files();
/// Another process reads and writes the files while act() runs.
void share_files(const std::function<void()>& act);
/// The process does not end from now on, and no operation fails.
void spare_process();
/// Single reads and writes fail from now on, as kReadFails and kWriteFails strike.
void fail_operations();
/// Number of open files below that folder.
std::size_t open_files(const std::string& folder);
/// While the disk is full, files cannot grow beyond the space that others have freed meanwhile.
void set_disk_full(bool is_full);
/// While it is unreadable, reading a file fails.
void set_disk_unreadable(bool is_unreadable);
/// Number of operations so far.
std::uint64_t disk_operations();

}  // namespace simulation
