// Replaces pread() of the C library in this program and the libraries that it loads.
#include "tests/unit/server/failing_reads.h"

#include <cerrno>
#include <utility>

#include <sys/syscall.h>
#include <unistd.h>

namespace {

constexpr int kNever = -2;
constexpr int kFailed = -1;
thread_local int left = kNever;

}  // namespace

namespace test_support {

void fail_read_after(int reads) { left = reads; }

bool end_failing_reads() { return std::exchange(left, kNever) == kFailed; }

}  // namespace test_support

extern "C" {

ssize_t pread(int fd, void* bytes, size_t count, off_t offset) {
  if (left >= 0 && left-- == 0) {
    errno = EIO;
    return -1;
  }
  return ::syscall(SYS_pread64, fd, bytes, count, offset);
}

ssize_t pread64(int fd, void* bytes, size_t count, off64_t offset) {
  return pread(fd, bytes, count, offset);
}

}  // extern "C"
