/// Executor: runs the threads of this process one at a time, in virtual time, in an order that
/// follows from a seed.
///
/// machine.cpp replaces the functions of the C library that create threads, wait, lock and read the
/// time; they call this. A simulated thread has a stack of its own and shares the process's only
/// real one, so that a turn costs no call of the kernel. It runs until it waits, ends, or a draw at
/// a lock says that another one goes on. When every thread waits, the time jumps to the earliest
/// deadline. Threads that were not started by a simulated thread are left alone. Variables that are
/// local to a thread are those of all: none may hold a state beyond a wait.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string>

#include <pthread.h>

namespace simulation {

using Nanoseconds = std::int64_t;
inline constexpr Nanoseconds kSecond = 1'000'000'000;
inline constexpr Nanoseconds kNever = std::numeric_limits<Nanoseconds>::max();

/// Numbers that follow from a seed. Source: SplitMix64, Steele et al. 2014.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next();
  /// In [0, 1).
  double uniform();
  /// In [0, count).
  std::size_t below(std::size_t count) { return next() % count; }
  bool chance(double probability) { return uniform() < probability; }
  /// Of a distribution with that mean.
  double exponential(double mean);

 private:
  std::uint64_t state_;
};

struct Schedule {
  std::uint64_t seed = 0;
  Nanoseconds start = 0;  ///< The monotonic clock at the start.
  /// Chance that another thread goes on before a lock is taken.
  double preempt = 0.01;
  /// Whether a thread may stand still there for some seconds, as on a machine that swaps.
  bool may_stall = false;
  /// Mean CPU time between two readings of a thread's CPU clock: the cost of rendering.
  Nanoseconds slice_mean = kSecond / 100;
  /// Called when every thread waits without a deadline, with what they wait for. Must not return.
  std::function<void(const std::string&)> on_deadlock = {};
};

/// The calling thread becomes the first simulated one. Once per process.
void begin(Schedule schedule);
/// Whether the calling thread is simulated and may be switched.
bool is_simulated();
Nanoseconds now();
/// The time since 1970 that the server reads.
Nanoseconds unix_now();
/// Sets that clock forward or back.
void jump_clock(Nanoseconds by);
Random& randomness();
void sleep_for(Nanoseconds time);
/// No other thread goes on while an object of this class lives, unless this thread waits.
class Undisturbed {
 public:
  Undisturbed();
  ~Undisturbed();
  Undisturbed(const Undisturbed&) = delete;
  Undisturbed& operator=(const Undisturbed&) = delete;
};

// For machine.cpp; all of a simulated thread.
int create_thread(pthread_t* thread, const pthread_attr_t* attributes, void* (*body)(void*),
                  void* argument);
/// Returns the calling thread.
pthread_t own_number();
/// Its number, counted from 0 in the order of their starts.
int thread_number();
/// Empty: that of the process.
std::span<std::byte> stack_of(pthread_t thread);
/// Waits for the end of a thread; returns false for one that is not simulated.
bool wait_for_end(pthread_t thread);
/// Lets another thread go on, perhaps.
void pass();
/// Waits until wake(address) or the deadline; returns false at the deadline.
bool wait(const void* address, Nanoseconds deadline);
void wake(const void* address, bool all);
/// The thread's CPU time; reading it costs some, as rendering does.
Nanoseconds spend_cpu();

}  // namespace simulation
