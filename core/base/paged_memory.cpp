#include "core/base/paged_memory.h"

#include <cstdlib>
#include <new>
#include <optional>
#include <utility>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include "core/base/descriptor.h"
#include "core/base/mutex.h"

namespace core {
namespace {

struct Folder {
  Mutex mutex;
  std::string path GUARDED_BY(mutex);
  std::optional<bool> works GUARDED_BY(mutex);  ///< a file can be made in it; empty: not tried

  std::string get() {
    const MutexLock lock(mutex);
    if (path.empty()) {
      const char* given = std::getenv("TMPDIR");  // NOLINT(concurrency-mt-unsafe): never set here
      path = given != nullptr && *given != '\0' ? given : "/var/tmp";
    }
    return path;
  }
};

Folder& folder() {
  static Folder folder;
  return folder;
}

/// Returns a file without a name that has room for the bytes on its disk, if there can be one.
UniqueFd make_file(std::size_t bytes) {
  rlimit most = {};
  if (::getrlimit(RLIMIT_FSIZE, &most) == 0 && most.rlim_cur < bytes) {
    return UniqueFd();  // a signal would end the process
  }
  std::string path = folder().get();
  UniqueFd file(::open(path.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600));
  if (!file) {
    path += "/paged-XXXXXX";
    file = UniqueFd(::mkostemp(path.data(), O_CLOEXEC));
    if (file) {
      ::unlink(path.c_str());
    }
  }
  // Without its blocks, a full disk would end the process at a write.
  if (file && ::posix_fallocate(file.get(), 0, static_cast<off_t>(bytes)) != 0) {
    return UniqueFd();
  }
  return file;
}

}  // namespace

std::size_t resident_bytes(std::size_t bytes) noexcept {
  if (bytes < kPagedBytes) {
    return bytes;
  }
  Folder& of = folder();
  std::optional<bool> works;
  {
    const MutexLock lock(of.mutex);
    works = of.works;
  }
  if (!works) {
    works = static_cast<bool>(make_file(kPagedBytes));
    const MutexLock lock(of.mutex);
    of.works = works;
  }
  return *works ? 0 : bytes;
}

void set_paging_folder(std::string path) {
  Folder& of = folder();
  const MutexLock lock(of.mutex);
  of.path = std::move(path);
  of.works.reset();
}

namespace paged_memory {

void* allocate(std::size_t bytes) {
  const UniqueFd file = make_file(bytes);
  // Shared also without a file, so that set_aside() keeps its contents.
  const int flags = MAP_SHARED | (file ? 0 : MAP_ANONYMOUS);
  void* const p = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, flags, file.get(), 0);
  if (p == MAP_FAILED) {
    throw std::bad_alloc();
  }
  return p;
}

void release(void* p, std::size_t bytes) noexcept { ::munmap(p, bytes); }

void set_aside(const void* p, std::size_t bytes) noexcept {
  ::madvise(const_cast<void*>(p), bytes, MADV_DONTNEED);
}

}  // namespace paged_memory
}  // namespace core
