#include "tests/simulation/disk.h"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstdarg>
#include <cstring>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "tests/simulation/faults.h"
#include "tests/simulation/real.h"

namespace simulation {
namespace {

constexpr std::uint64_t kSector = 512;
constexpr std::uint64_t kPage = 4096;
/// A file's first mapping; each further one is at least twice as long.
constexpr std::uint64_t kMapping = std::uint64_t{64} << 10U;

struct Change {
  std::uint64_t offset = 0;
  std::string before = {};
  std::string after = {};
  std::uint64_t size_before = 0;
  std::uint64_t size_after = 0;
};

struct Name {
  enum class Kind : std::uint8_t { kCreated, kRenamed, kRemoved };
  Kind kind = Kind::kCreated;
  std::string path;
  std::string from = {};   ///< Of a renamed file.
  std::string trash = {};  ///< Where the file is that had the name before; empty: none.
};

struct File {
  std::string path;
  std::uint64_t size = 0;
  std::vector<Change> unsynced;
  std::uint64_t length = 0;    ///< Of the real file, where it is longer: see is_log().
  std::byte* bytes = nullptr;  ///< Its first `mapped` bytes, of which those after `size` are none.
  std::uint64_t mapped = 0;
};

/// A database's log grows and is cut thousands of times a day. The real file keeps its length while
/// the process lives, so that this costs no call of the kernel.
bool is_log(const File& file) { return file.path.ends_with("-wal"); }

struct State {
  State(std::string folder, DiskFaults given)
      : root(std::move(folder)), faults(std::move(given)), random(faults.seed) {}
  std::string root;
  DiskFaults faults;
  Random random;
  std::uint64_t operations = 0;
  std::map<int, ino_t> open;
  std::map<ino_t, File> files;
  std::vector<Name> names;
  std::uint64_t removed = 0;
  bool is_unreadable = false;
  bool is_failing = false;
  std::optional<std::uint64_t> room;  ///< Bytes that files may grow by; empty: not full.
};

State* disk = nullptr;

bool is_ours(const char* path) {
  return disk != nullptr && is_simulated() && std::string_view(path).starts_with(disk->root);
}

File* file_of(int fd) {
  if (disk == nullptr || !is_simulated()) {
    return nullptr;
  }
  const auto found = disk->open.find(fd);
  return found == disk->open.end() ? nullptr : &disk->files[found->second];
}

/// Returns the file's bytes from there in memory, which costs no call of the kernel; null: they are
/// not all in the file, or the descriptor is for one direction.
std::byte* mapped(int fd, File& file, std::uint64_t offset, std::size_t count) {
  const std::uint64_t end = offset + count;
  if (end > std::max(file.size, file.length)) {
    return nullptr;
  }
  if (end > file.mapped) {
    const std::uint64_t length = std::max(kMapping, std::bit_ceil(std::max(file.size, end)));
    void* const bytes = ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    if (bytes == MAP_FAILED) {
      return nullptr;
    }
    if (file.bytes != nullptr) {
      ::munmap(file.bytes, file.mapped);
    }
    file.bytes = static_cast<std::byte*>(bytes);
    file.mapped = length;
  }
  return file.bytes + offset;
}

ssize_t read_from(int fd, File& file, void* to, std::size_t count, off_t offset) {
  const auto at = static_cast<std::uint64_t>(offset);
  if (file.length > file.size) {
    count = at < file.size ? std::min<std::uint64_t>(count, file.size - at) : 0;
  }
  const std::byte* from = mapped(fd, file, at, count);
  if (from == nullptr) {
    return real::pread(fd, to, count, offset);
  }
  std::memcpy(to, from, count);
  return static_cast<ssize_t>(count);
}

/// Makes the real file of a log long enough.
void lengthen(int fd, File& file, std::uint64_t end) {
  const std::uint64_t length = std::max(kMapping, std::bit_ceil(end));
  if (end > std::max(file.size, file.length) &&
      real::ftruncate(fd, static_cast<off_t>(length)) == 0) {
    file.length = length;
  }
}

ssize_t put(int fd, File& file, const void* from, std::size_t count, off_t offset) {
  const auto at = static_cast<std::uint64_t>(offset);
  if (is_log(file)) {
    lengthen(fd, file, at + count);
  }
  std::byte* to = mapped(fd, file, at, count);
  if (to == nullptr) {
    return real::pwrite(fd, from, count, offset);
  }
  if (at > file.size) {  // What was cut off before is no part of the hole.
    std::memset(file.bytes + file.size, 0, at - file.size);
  }
  std::memcpy(to, from, count);
  return static_cast<ssize_t>(count);
}

/// Cuts the real file to the size that it tells.
void shorten(File& file) {
  if (file.length > file.size) {
    ::truncate(file.path.c_str(), static_cast<off_t>(file.size));
  }
  file.length = 0;
}

/// A call that tells the size of a file tells that.
template <typename Info>
void tell_size(const File* file, Info& info) {
  if (file != nullptr && file->length > file->size) {
    info.st_size = static_cast<off_t>(file->size);
  }
}

std::string read_back(int fd, File& file, std::uint64_t offset, std::size_t count) {
  std::string bytes(count, '\0');
  const ssize_t got = read_from(fd, file, bytes.data(), count, static_cast<off_t>(offset));
  bytes.resize(got < 0 ? 0 : static_cast<std::size_t>(got));
  return bytes;
}

/// Returns whether SQLite locks for one read or write by that (walformat.html, 2.3.2: bytes 120 to
/// 127). Such locks are between processes, and no other comes while one is held.
bool is_of_transaction(const File& file, const struct flock& lock) {
  return file.path.ends_with("-shm") && lock.l_start >= 120 && lock.l_start + lock.l_len <= 128;
}

/// Returns whether the process ends now.
bool count_operation() {
  const Fault kind = disk->faults.loses_power ? Fault::kPowerLost : Fault::kKilled;
  if (++disk->operations == disk->faults.end_at) {
    count_fault(kind);
    return true;
  }
  return disk->faults.ends && strikes(kind);
}

/// Returns whether the operation fails, with errno.
bool fails(Fault kind) {
  if (!disk->is_failing || !strikes(kind)) {
    return false;
  }
  errno = EIO;
  return true;
}

void end() {
  if (disk->faults.loses_power) {
    lose_power();
  }
  disk->faults.end();
}

void end_if_due() {
  if (count_operation()) {
    end();
  }
}

bool grows_too_far(std::uint64_t from, std::uint64_t to) {
  if (disk->room && to > from && to - from > *disk->room) {
    return true;
  }
  if (disk->room) {
    *disk->room = *disk->room + from - to;
  }
  return false;
}

/// Makes a change, after which the file has that size, and keeps it apart if it can be lost. act:
/// makes it.
template <typename Act>
auto change(int fd, File& file, Change made, std::uint64_t size, const Act& act) {
  if (!disk->faults.loses_power) {
    const auto result = act();
    file.size = size;
    return result;
  }
  made.size_before = file.size;
  made.size_after = size;
  if (made.offset < file.size) {
    made.before = read_back(fd, file, made.offset, made.after.size());
  }
  const auto result = act();
  file.size = size;
  file.unsynced.push_back(std::move(made));
  return result;
}

ssize_t write_to(int fd, File& file, const void* bytes, std::size_t count, off_t offset) {
  if (fails(Fault::kWriteFails)) {
    return -1;
  }
  const auto at = static_cast<std::uint64_t>(offset);
  const bool ends = count_operation();
  const std::size_t whole = count;
  if (ends) {  // Linux heeds a signal between the pages of a write.
    const std::size_t most = disk->random.below(count + 1);
    const std::size_t page_end = (at + most) / kPage * kPage;
    count = most == count ? count : page_end > at ? page_end - at : 0;
  }
  const std::uint64_t size = count > 0 ? std::max(file.size, at + count) : file.size;
  if (grows_too_far(file.size, size)) {
    errno = ENOSPC;
    return -1;
  }
  Change made{.offset = at};
  if (disk->faults.loses_power) {
    made.after.assign(static_cast<const char*>(bytes), count);
  }
  const ssize_t written =
      change(fd, file, std::move(made), size, [&] { return put(fd, file, bytes, count, offset); });
  if (ends) {
    end();
  }
  return count == whole ? written : static_cast<ssize_t>(whole);
}

/// Takes the time of a sync.
void take_time() {
  if (disk->faults.sync_mean > 0) {
    sleep_for(static_cast<Nanoseconds>(
        disk->random.exponential(static_cast<double>(disk->faults.sync_mean))));
  }
}

int cut(int fd, File& file, off_t size) {
  end_if_due();
  const std::uint64_t before = file.size;
  const auto after = static_cast<std::uint64_t>(size);
  if (grows_too_far(before, after)) {
    errno = ENOSPC;
    return -1;
  }
  // What is cut off can come back.
  Change made{.offset = std::min(before, after)};
  if (after < before) {
    made.after.resize(before - after);
    take_time();
  }
  return change(fd, file, made, after,
                [&] { return after < file.length ? 0 : real::ftruncate(fd, size); });
}

int sync(int fd, File& file) {
  end_if_due();
  if (fails(Fault::kWriteFails)) {
    return -1;
  }
  take_time();
  file.unsynced.clear();
  const auto named = std::find_if(disk->names.begin(), disk->names.end(), [&](const Name& name) {
    return name.kind == Name::Kind::kCreated && name.path == file.path;
  });
  if (named != disk->names.end()) {
    disk->names.erase(disk->names.begin(), named + 1);
  }
  static_cast<void>(fd);
  return 0;
}

std::string trash_of(const std::string& path) {
  struct stat info = {};
  if (::stat(path.c_str(), &info) != 0) {
    return "";
  }
  if (disk->room) {
    *disk->room += static_cast<std::uint64_t>(info.st_size);
  }
  const std::string trash = disk->root + ".trash" + std::to_string(++disk->removed);
  real::rename(path.c_str(), trash.c_str());
  if (const auto found = disk->files.find(info.st_ino); found != disk->files.end()) {
    found->second.path = trash;
  }
  return trash;
}

void take_back(const Name& name) {
  if (name.kind == Name::Kind::kCreated) {
    real::unlink(name.path.c_str());
  } else if (name.kind == Name::Kind::kRenamed) {
    real::rename(name.path.c_str(), name.from.c_str());
  }
  if (!name.trash.empty()) {
    real::rename(name.trash.c_str(), name.path.c_str());
  }
}

/// Keeps any sectors of any changes, in their order.
void lose_changes(File& file) {
  shorten(file);
  const int fd = real::open(file.path.c_str(), O_RDWR | O_CLOEXEC, 0);
  if (fd < 0 || file.unsynced.empty()) {
    return;
  }
  for (auto change = file.unsynced.rbegin(); change != file.unsynced.rend(); ++change) {
    real::pwrite(fd, change->before.data(), change->before.size(),
                 static_cast<off_t>(change->offset));
    real::ftruncate(fd, static_cast<off_t>(change->size_before));
  }
  const double share = disk->random.chance(0.3) ? 0 : disk->random.uniform();
  for (const Change& change : file.unsynced) {
    const bool cuts = change.size_after < change.size_before;
    if (cuts) {
      if (disk->random.chance(share)) {
        real::ftruncate(fd, static_cast<off_t>(change.size_after));
      }
      continue;
    }
    for (std::uint64_t from = 0; from < change.after.size();) {
      const std::uint64_t sector = kSector - (change.offset + from) % kSector;
      const std::uint64_t count = std::min<std::uint64_t>(sector, change.after.size() - from);
      if (disk->random.chance(share)) {
        real::pwrite(fd, change.after.data() + from, count,
                     static_cast<off_t>(change.offset + from));
      }
      from += count;
    }
  }
  ::close(fd);
}

int open_file(const char* path, int flags, mode_t mode) {
  if (std::strcmp(path, "/dev/urandom") == 0 && is_simulated()) {
    path = "/dev/zero";  // SQLite's salts.
  }
  if (!is_ours(path)) {
    return real::open(path, flags, mode);
  }
  struct stat info = {};
  int fd = real::open(path, flags & ~O_CREAT, mode);
  const bool is_new = fd < 0 && errno == ENOENT && (flags & O_CREAT) != 0;
  if (is_new) {
    end_if_due();
  }
  if (is_new || (flags & O_EXCL) != 0) {
    ::close(fd);
    fd = real::open(path, flags, mode);
  }
  if (fd < 0 || ::fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) {
    return fd;
  }
  disk->open[fd] = info.st_ino;
  File& file = disk->files[info.st_ino];
  file.path = path;
  if (is_new) {
    file.unsynced.clear();  // Of another file that had the number before.
    file.length = 0;
    disk->names.push_back({.kind = Name::Kind::kCreated, .path = path});
  }
  tell_size(&file, info);
  file.size = static_cast<std::uint64_t>(info.st_size);
  return fd;
}

}  // namespace

void use_disk(const std::string& root, DiskFaults faults) {
  disk = new State(root, std::move(faults));  // Lives as long as the process.
}

void lose_power() {
  for (auto& [inode, file] : disk->files) {
    lose_changes(file);
  }
  std::size_t lost = disk->names.empty() ? 0 : disk->random.below(disk->names.size() + 1);
  for (auto name = disk->names.rbegin(); lost > 0; ++name, --lost) {
    take_back(*name);
  }
}

void shorten_files() {
  for (auto& [inode, file] : disk->files) {
    shorten(file);
  }
}

void share_files(const std::function<void()>& act) {
  shorten_files();
  act();
  for (auto& [inode, file] : disk->files) {
    struct stat64 info = {};
    if (real::stat64(file.path.c_str(), &info) == 0) {
      file.size = static_cast<std::uint64_t>(info.st_size);
    }
  }
}

void spare_process() {
  disk->faults.end_at = 0;
  disk->faults.ends = false;
  disk->is_failing = false;
}

void fail_operations() { disk->is_failing = true; }

std::size_t open_files(const std::string& folder) {
  return static_cast<std::size_t>(std::count_if(
      disk->open.begin(), disk->open.end(),
      [&](const auto& entry) { return disk->files[entry.second].path.starts_with(folder); }));
}

void set_disk_full(bool is_full) {
  if (is_full) {
    count_fault(Fault::kDiskFull);
  }
  disk->room = is_full ? std::optional<std::uint64_t>(0) : std::nullopt;
}

void set_disk_unreadable(bool is_unreadable) {
  if (is_unreadable) {
    count_fault(Fault::kDiskUnreadable);
  }
  disk->is_unreadable = is_unreadable;
}

std::uint64_t disk_operations() { return disk->operations; }

}  // namespace simulation

using simulation::disk;
using simulation::file_of;
using simulation::is_ours;
namespace real = simulation::real;

extern "C" {

int open(const char* path, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(list, mode_t) : 0;
  va_end(list);
  return simulation::open_file(path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(list, mode_t) : 0;
  va_end(list);
  return simulation::open_file(path, flags, mode);
}

int close(int fd) {
  if (file_of(fd) != nullptr) {
    disk->open.erase(fd);
  }
  return real::close(fd);
}

ssize_t pwrite(int fd, const void* bytes, size_t count, off_t offset) {
  simulation::File* file = file_of(fd);
  return file != nullptr ? simulation::write_to(fd, *file, bytes, count, offset)
                         : real::pwrite(fd, bytes, count, offset);
}

ssize_t pread(int fd, void* bytes, size_t count, off_t offset) {
  simulation::File* file = file_of(fd);
  if (file == nullptr) {
    return real::pread(fd, bytes, count, offset);
  }
  if (disk->is_unreadable) {
    errno = EIO;
    return -1;
  }
  return simulation::fails(simulation::Fault::kReadFails)
             ? -1
             : simulation::read_from(fd, *file, bytes, count, offset);
}

ssize_t pread64(int fd, void* bytes, size_t count, off64_t offset) {
  return pread(fd, bytes, count, offset);
}

int fcntl64(int fd, int command, ...) {
  va_list list;
  va_start(list, command);
  void* const argument = va_arg(list, void*);
  va_end(list);
  const simulation::File* file = file_of(fd);
  return file != nullptr && command == F_SETLK &&
                 simulation::is_of_transaction(*file, *static_cast<struct flock*>(argument))
             ? 0
             : real::fcntl64(fd, command, argument);
}

ssize_t pwrite64(int fd, const void* bytes, size_t count, off64_t offset) {
  return pwrite(fd, bytes, count, offset);
}

int ftruncate(int fd, off_t size) noexcept {
  simulation::File* file = file_of(fd);
  return file != nullptr ? simulation::cut(fd, *file, size) : real::ftruncate(fd, size);
}

int ftruncate64(int fd, off64_t size) noexcept { return ftruncate(fd, size); }

int fstat64(int fd, struct stat64* info) noexcept {
  const int failed = real::fstat64(fd, info);
  if (failed == 0) {
    simulation::tell_size(file_of(fd), *info);
  }
  return failed;
}

int fstat(int fd, struct stat* info) noexcept {
  static_assert(sizeof(struct stat) == sizeof(struct stat64));
  return fstat64(fd, reinterpret_cast<struct stat64*>(info));
}

int stat64(const char* path, struct stat64* info) noexcept {
  const int failed = real::stat64(path, info);
  if (failed == 0 && is_ours(path)) {
    const auto found = disk->files.find(info->st_ino);
    simulation::tell_size(found == disk->files.end() ? nullptr : &found->second, *info);
  }
  return failed;
}

int stat(const char* path, struct stat* info) noexcept {
  return stat64(path, reinterpret_cast<struct stat64*>(info));
}

/// Punches holes.
int fallocate(int fd, int mode, off_t offset, off_t count) {
  simulation::File* file = file_of(fd);
  if (file == nullptr) {
    return real::fallocate(fd, mode, offset, count);
  }
  simulation::end_if_due();
  const std::uint64_t size = file->size;
  const auto from = static_cast<std::uint64_t>(offset);
  const auto most = from < size ? std::min(size - from, static_cast<std::uint64_t>(count)) : 0;
  const simulation::Change made{.offset = from, .after = std::string(most, '\0')};
  return simulation::change(fd, *file, made, size,
                            [&] { return real::fallocate(fd, mode, offset, count); });
}

int fallocate64(int fd, int mode, off64_t offset, off64_t count) {
  return fallocate(fd, mode, offset, count);
}

int posix_fallocate(int fd, off_t offset, off_t count) {
  simulation::File* file = file_of(fd);
  if (file == nullptr) {
    return real::posix_fallocate(fd, offset, count);
  }
  const auto size = static_cast<off_t>(file->size);
  return offset + count <= size || simulation::cut(fd, *file, offset + count) == 0 ? 0 : ENOSPC;
}

int posix_fallocate64(int fd, off64_t offset, off64_t count) {
  return posix_fallocate(fd, offset, count);
}

int fdatasync(int fd) {
  simulation::File* file = file_of(fd);
  return file != nullptr ? simulation::sync(fd, *file) : real::fdatasync(fd);
}

int fsync(int fd) {
  if (simulation::File* file = file_of(fd)) {
    return simulation::sync(fd, *file);
  }
  if (disk != nullptr && simulation::is_simulated()) {  // A folder.
    simulation::end_if_due();
    disk->names.clear();
    return 0;
  }
  return real::fsync(fd);
}

int rename(const char* from, const char* to) noexcept {
  if (!is_ours(to)) {
    return real::rename(from, to);
  }
  simulation::end_if_due();
  const std::string trash = simulation::trash_of(to);
  const int failed = real::rename(from, to);
  disk->names.push_back(
      {.kind = simulation::Name::Kind::kRenamed, .path = to, .from = from, .trash = trash});
  for (auto& [inode, file] : disk->files) {
    if (file.path == from) {
      file.path = to;
    }
  }
  return failed;
}

int unlink(const char* path) noexcept {
  if (!is_ours(path)) {
    return real::unlink(path);
  }
  simulation::end_if_due();
  const std::string trash = simulation::trash_of(path);
  if (trash.empty()) {
    errno = ENOENT;
    return -1;
  }
  disk->names.push_back({.kind = simulation::Name::Kind::kRemoved, .path = path, .trash = trash});
  return 0;
}

int statvfs(const char* path, struct statvfs* info) noexcept {
  const int failed = real::statvfs(path, info);
  if (is_ours(path) && disk->room) {
    info->f_bavail = *disk->room / info->f_frsize;
  }
  return failed;
}

int statvfs64(const char* path, struct statvfs64* info) noexcept {
  struct statvfs plain = {};
  const int failed = ::statvfs(path, &plain);
  static_assert(sizeof *info == sizeof plain);
  std::memcpy(info, &plain, sizeof plain);
  return failed;
}

}  // extern "C"
