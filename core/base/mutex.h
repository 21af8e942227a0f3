/// Mutex, MutexLock and CondVar: the standard classes with clang thread-safety annotations.
#pragma once

#include <condition_variable>
#include <mutex>

#ifdef __clang__
#define TESSERA_TS(x) __attribute__((x))
#else
#define TESSERA_TS(x)
#endif
#define CAPABILITY(x) TESSERA_TS(capability(x))
#define SCOPED_CAPABILITY TESSERA_TS(scoped_lockable)
#define GUARDED_BY(x) TESSERA_TS(guarded_by(x))
#define REQUIRES(...) TESSERA_TS(requires_capability(__VA_ARGS__))
#define EXCLUDES(...) TESSERA_TS(locks_excluded(__VA_ARGS__))
#define ACQUIRE(...) TESSERA_TS(acquire_capability(__VA_ARGS__))
#define RELEASE(...) TESSERA_TS(release_capability(__VA_ARGS__))

namespace core {

class CAPABILITY("mutex") Mutex {
 public:
  void lock() ACQUIRE() { mutex_.lock(); }
  void unlock() RELEASE() { mutex_.unlock(); }

 private:
  std::mutex mutex_;
};

class SCOPED_CAPABILITY MutexLock {
 public:
  explicit MutexLock(Mutex& mutex) ACQUIRE(mutex) : mutex_(mutex) { mutex_.lock(); }
  ~MutexLock() RELEASE() { mutex_.unlock(); }
  MutexLock(const MutexLock&) = delete;
  MutexLock& operator=(const MutexLock&) = delete;

 private:
  Mutex& mutex_;
};

/// Waits on a Mutex that the caller holds: `while (!ready) cond.wait_for(mutex, ...)`.
using CondVar = std::condition_variable_any;

}  // namespace core
