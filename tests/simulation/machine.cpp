// The functions of the C library by which a program starts threads, waits, locks, reads the time
// and gets random numbers. In simulated threads they ask the Executor. The standard library,
// SQLite and the server call them alike, so nothing of the server has to know of the simulation.
#include <algorithm>
#include <cerrno>
#include <cstdarg>
#include <cstddef>
#include <random>
#include <span>

#include <linux/futex.h>
#include <openssl/rand.h>
#include <sched.h>
#include <sys/random.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>

#include "tests/simulation/executor.h"
#include "tests/simulation/real.h"

namespace {

using simulation::is_simulated;
using simulation::kNever;
using simulation::kSecond;
using simulation::Nanoseconds;
namespace real = simulation::real;

constexpr Nanoseconds kMicrosecond = 1000;

Nanoseconds of(const timespec& time) {
  return Nanoseconds{time.tv_sec} * kSecond + Nanoseconds{time.tv_nsec};
}

timespec as_timespec(Nanoseconds time) { return {time / kSecond, time % kSecond}; }

/// The monotonic time at which the clock shows that time.
Nanoseconds deadline_of(clockid_t clock, const timespec& time) {
  const Nanoseconds ahead = simulation::unix_now() - simulation::now();
  return of(time) - (clock == CLOCK_MONOTONIC ? 0 : ahead);
}

bool is_recursive(const pthread_mutex_t* mutex) {
  return (mutex->__data.__kind & 3) == PTHREAD_MUTEX_RECURSIVE;
}

/// A recursive mutex (SQLite's) would belong to the real thread: its own members name the simulated
/// one.
int try_lock(pthread_mutex_t* mutex) {
  if (!is_recursive(mutex)) {
    return real::pthread_mutex_trylock(mutex);
  }
  auto& data = mutex->__data;
  if (data.__count > 0 && data.__owner != simulation::thread_number()) {
    return EBUSY;
  }
  data.__owner = simulation::thread_number();
  ++data.__count;
  return 0;
}

void lock(pthread_mutex_t* mutex) {
  while (try_lock(mutex) == EBUSY) {
    simulation::wait(mutex, kNever);
  }
}

int unlock(pthread_mutex_t* mutex) {
  if (!is_recursive(mutex)) {
    return real::pthread_mutex_unlock(mutex);
  }
  --mutex->__data.__count;
  return 0;
}

int wait_on(pthread_cond_t* condition, pthread_mutex_t* mutex, Nanoseconds deadline) {
  unlock(mutex);
  simulation::wake(mutex, true);
  const bool came = simulation::wait(condition, deadline);
  lock(mutex);
  return came ? 0 : ETIMEDOUT;
}

void fill(void* bytes, std::size_t count) {
  auto* at = static_cast<unsigned char*>(bytes);
  std::generate(at, at + count,
                [] { return static_cast<unsigned char>(simulation::randomness().next() & 0xffU); });
}

}  // namespace

extern "C" {

int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*body)(void*),
                   void* argument) {
  return is_simulated() ? simulation::create_thread(thread, attributes, body, argument)
                        : real::pthread_create(thread, attributes, body, argument);
}

int pthread_join(pthread_t thread, void** result) {
  if (is_simulated() && simulation::wait_for_end(thread)) {
    return 0;
  }
  return real::pthread_join(thread, result);
}

/// oneTBB asks where its stack ends.
int pthread_getattr_np(pthread_t thread, pthread_attr_t* attributes) noexcept {
  const auto stack = is_simulated() ? simulation::stack_of(thread) : std::span<std::byte>();
  if (stack.empty()) {
    return real::pthread_getattr_np(is_simulated() ? real::pthread_self() : thread, attributes);
  }
  pthread_attr_init(attributes);
  return pthread_attr_setstack(attributes, stack.data(), stack.size());
}

/// oneTBB holds the state of a build in its thread, which others would change.
void rtcCommitScene(void* scene) {
  const simulation::Undisturbed alone;
  real::rtcCommitScene(scene);
}

pthread_t pthread_self() noexcept {
  return is_simulated() ? simulation::own_number() : real::pthread_self();
}

int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  if (!is_simulated()) {
    return real::pthread_mutex_lock(mutex);
  }
  simulation::pass();
  lock(mutex);
  return 0;
}

int pthread_mutex_trylock(pthread_mutex_t* mutex) noexcept {
  return is_simulated() ? try_lock(mutex) : real::pthread_mutex_trylock(mutex);
}

int pthread_mutex_unlock(pthread_mutex_t* mutex) noexcept {
  if (!is_simulated()) {
    return real::pthread_mutex_unlock(mutex);
  }
  const int code = unlock(mutex);
  simulation::wake(mutex, true);
  return code;
}

int pthread_cond_wait(pthread_cond_t* condition, pthread_mutex_t* mutex) {
  return is_simulated() ? wait_on(condition, mutex, kNever)
                        : real::pthread_cond_wait(condition, mutex);
}

int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex,
                           const timespec* time) {
  return is_simulated() ? wait_on(condition, mutex, deadline_of(CLOCK_REALTIME, *time))
                        : real::pthread_cond_timedwait(condition, mutex, time);
}

int pthread_cond_clockwait(pthread_cond_t* condition, pthread_mutex_t* mutex, clockid_t clock,
                           const timespec* time) {
  return is_simulated() ? wait_on(condition, mutex, deadline_of(clock, *time))
                        : real::pthread_cond_clockwait(condition, mutex, clock, time);
}

int pthread_cond_signal(pthread_cond_t* condition) noexcept {
  if (!is_simulated()) {
    return real::pthread_cond_signal(condition);
  }
  simulation::wake(condition, false);
  return 0;
}

int pthread_cond_broadcast(pthread_cond_t* condition) noexcept {
  if (!is_simulated()) {
    return real::pthread_cond_broadcast(condition);
  }
  simulation::wake(condition, true);
  return 0;
}

int pthread_rwlock_rdlock(pthread_rwlock_t* lock) noexcept {
  if (!is_simulated()) {
    return real::pthread_rwlock_rdlock(lock);
  }
  simulation::pass();
  int code = 0;
  while ((code = real::pthread_rwlock_tryrdlock(lock)) == EBUSY) {
    simulation::wait(lock, kNever);
  }
  return code;
}

int pthread_rwlock_wrlock(pthread_rwlock_t* lock) noexcept {
  if (!is_simulated()) {
    return real::pthread_rwlock_wrlock(lock);
  }
  simulation::pass();
  int code = 0;
  while ((code = real::pthread_rwlock_trywrlock(lock)) == EBUSY) {
    simulation::wait(lock, kNever);
  }
  return code;
}

int pthread_rwlock_unlock(pthread_rwlock_t* lock) noexcept {
  const int code = real::pthread_rwlock_unlock(lock);
  if (is_simulated()) {
    simulation::wake(lock, true);
  }
  return code;
}

int pthread_once(pthread_once_t* control, void (*routine)()) {
  const simulation::Undisturbed alone;  // Another thread would wait in the C library.
  return real::pthread_once(control, routine);
}

int clock_gettime(clockid_t clock, timespec* time) noexcept {
  if (!is_simulated()) {
    return real::clock_gettime(clock, time);
  }
  if (clock == CLOCK_THREAD_CPUTIME_ID) {
    *time = as_timespec(simulation::spend_cpu());
  } else if (clock == CLOCK_REALTIME) {
    *time = as_timespec(simulation::unix_now());
  } else {
    *time = as_timespec(simulation::now());
  }
  return 0;
}

int gettimeofday(timeval* time, void* /*zone*/) noexcept {
  timespec now = {};
  clock_gettime(CLOCK_REALTIME, &now);
  *time = {now.tv_sec, now.tv_nsec / kMicrosecond};
  return 0;
}

time_t time(time_t* to) noexcept {
  timespec now = {};
  clock_gettime(CLOCK_REALTIME, &now);
  if (to != nullptr) {
    *to = now.tv_sec;
  }
  return now.tv_sec;
}

int nanosleep(const timespec* span, timespec* left) {
  if (!is_simulated()) {
    return real::nanosleep(span, left);
  }
  simulation::sleep_for(of(*span));
  return 0;
}

int usleep(useconds_t span) {
  const timespec time = as_timespec(Nanoseconds{span} * kMicrosecond);
  return nanosleep(&time, nullptr);
}

int sched_yield() noexcept {
  if (!is_simulated()) {
    return real::sched_yield();
  }
  simulation::sleep_for(kMicrosecond);
  return 0;
}

int nice(int /*more*/) noexcept { return 0; }

/// The standard library waits for atomics by futexes; a wait may end without a reason.
long syscall(long number, ...) noexcept {
  va_list list;
  va_start(list, number);
  long arguments[6];
  for (long& argument : arguments) {
    argument = va_arg(list, long);
  }
  va_end(list);
  if (number == SYS_futex && is_simulated()) {
    simulation::sleep_for(kMicrosecond);
    return 0;
  }
  return real::syscall(number, arguments[0], arguments[1], arguments[2], arguments[3], arguments[4],
                       arguments[5]);
}

ssize_t getrandom(void* bytes, size_t count, unsigned int /*flags*/) {
  if (is_simulated()) {
    fill(bytes, count);
    return static_cast<ssize_t>(count);
  }
  return ::syscall(SYS_getrandom, bytes, count, 0);
}

int getentropy(void* bytes, size_t count) {
  return getrandom(bytes, count, 0) == static_cast<ssize_t>(count) ? 0 : -1;
}

int RAND_bytes(unsigned char* bytes, int count) {
  return getentropy(bytes, static_cast<size_t>(count)) == 0 ? 1 : 0;
}

}  // extern "C"

/// The processor's own numbers otherwise.
std::random_device::result_type std::random_device::_M_getval() {
  result_type value = 0;
  getentropy(&value, sizeof value);
  return value;
}
