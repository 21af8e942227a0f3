/// The functions of the C library that this program replaces, as they were.
#pragma once

#include <ctime>

#include <dlfcn.h>
#include <pthread.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/types.h>

namespace simulation::real {

/// Returns the next definition of the name after this program's.
template <typename Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

// Without a guard: threads that are not simulated may call them at the same time.
#define SIMULATION_REAL(result, name, ...)            \
  template <typename... Arguments>                    \
  result name(Arguments... arguments) {               \
    static result (*function)(__VA_ARGS__) = nullptr; \
    if (function == nullptr) {                        \
      function = next<result(__VA_ARGS__)>(#name);    \
    }                                                 \
    return function(arguments...);                    \
  }

SIMULATION_REAL(int, pthread_create, pthread_t*, const pthread_attr_t*, void* (*)(void*), void*)
SIMULATION_REAL(int, pthread_join, pthread_t, void**)
SIMULATION_REAL(pthread_t, pthread_self)
SIMULATION_REAL(int, pthread_getattr_np, pthread_t, pthread_attr_t*)
SIMULATION_REAL(void, rtcCommitScene, void*)
SIMULATION_REAL(int, pthread_mutex_lock, pthread_mutex_t*)
SIMULATION_REAL(int, pthread_mutex_trylock, pthread_mutex_t*)
SIMULATION_REAL(int, pthread_mutex_unlock, pthread_mutex_t*)
SIMULATION_REAL(int, pthread_cond_wait, pthread_cond_t*, pthread_mutex_t*)
SIMULATION_REAL(int, pthread_cond_timedwait, pthread_cond_t*, pthread_mutex_t*, const timespec*)
SIMULATION_REAL(int, pthread_cond_clockwait, pthread_cond_t*, pthread_mutex_t*, clockid_t,
                const timespec*)
SIMULATION_REAL(int, pthread_cond_signal, pthread_cond_t*)
SIMULATION_REAL(int, pthread_cond_broadcast, pthread_cond_t*)
SIMULATION_REAL(int, pthread_rwlock_rdlock, pthread_rwlock_t*)
SIMULATION_REAL(int, pthread_rwlock_wrlock, pthread_rwlock_t*)
SIMULATION_REAL(int, pthread_rwlock_tryrdlock, pthread_rwlock_t*)
SIMULATION_REAL(int, pthread_rwlock_trywrlock, pthread_rwlock_t*)
SIMULATION_REAL(int, pthread_rwlock_unlock, pthread_rwlock_t*)
SIMULATION_REAL(int, pthread_once, pthread_once_t*, void (*)())
SIMULATION_REAL(int, clock_gettime, clockid_t, timespec*)
SIMULATION_REAL(int, nanosleep, const timespec*, timespec*)
SIMULATION_REAL(int, sched_yield)
SIMULATION_REAL(long, syscall, long, ...)
SIMULATION_REAL(int, open, const char*, int, ...)
SIMULATION_REAL(int, close, int)
SIMULATION_REAL(int, fcntl64, int, int, ...)
SIMULATION_REAL(ssize_t, pread, int, void*, size_t, off_t)
SIMULATION_REAL(ssize_t, pwrite, int, const void*, size_t, off_t)
SIMULATION_REAL(int, ftruncate, int, off_t)
SIMULATION_REAL(int, fstat64, int, struct stat64*)
SIMULATION_REAL(int, stat64, const char*, struct stat64*)
SIMULATION_REAL(int, fallocate, int, int, off_t, off_t)
SIMULATION_REAL(int, posix_fallocate, int, off_t, off_t)
SIMULATION_REAL(int, fdatasync, int)
SIMULATION_REAL(int, fsync, int)
SIMULATION_REAL(int, rename, const char*, const char*)
SIMULATION_REAL(int, unlink, const char*)
SIMULATION_REAL(int, statvfs, const char*, struct statvfs*)

#undef SIMULATION_REAL

}  // namespace simulation::real
