#include "tests/simulation/executor.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include <dlfcn.h>
#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "tests/simulation/faults.h"
#include "tests/simulation/real.h"

namespace simulation {
namespace {

/// 2026-01-01.
constexpr Nanoseconds kUnixStart = 1767225600 * kSecond;

constexpr double kStallMean = 5.0 * kSecond;

struct Thread {
  std::size_t number = 0;
  std::atomic<std::uint32_t> go = 0;
  bool is_ready = true;
  bool is_over = false;
  bool came_in_time = false;
  const void* waits_for = nullptr;
  Nanoseconds deadline = kNever;
  Nanoseconds cpu = 0;
  int undisturbed = 0;
  pthread_t real = {};
  void* (*body)(void*) = nullptr;
  void* argument = nullptr;
};

struct State {
  explicit State(Schedule given)
      : schedule(std::move(given)), random(schedule.seed), now(schedule.start) {}
  Schedule schedule;
  Random random;
  Nanoseconds now;
  Nanoseconds jumped = 0;
  std::vector<std::unique_ptr<Thread>> threads;
  std::size_t started = 0;
  /// Threads that wait for addresses of that hash: most locks are waited for by none.
  std::array<std::uint16_t, 1024> waiting = {};
  std::uint16_t& waiting_for(const void* address) {
    return waiting[(reinterpret_cast<std::uintptr_t>(address) >> 3U) % waiting.size()];
  }
};

State* state = nullptr;
thread_local Thread* me = nullptr;

void futex(std::atomic<std::uint32_t>& word, int operation, std::uint32_t value) {
  real::syscall(SYS_futex, reinterpret_cast<long>(&word), operation, value, 0, 0, 0);
}

void resume(Thread& thread) {
  thread.go.store(1);
  futex(thread.go, FUTEX_WAKE_PRIVATE, 1);
}

void await_turn(Thread& thread) {
  while (thread.go.exchange(0) == 0) {
    futex(thread.go, FUTEX_WAIT_PRIVATE, 0);
  }
}

/// Draws the next thread; moves the time if all of them wait.
Thread& pick() {
  Thread* earliest = nullptr;
  std::size_t ready = 0;
  const auto may_run = [](const Thread& thread) {
    return !thread.is_over && (thread.is_ready || thread.deadline <= state->now);
  };
  for (const auto& thread : state->threads) {
    if (may_run(*thread)) {
      ++ready;
    } else if (!thread->is_over && (earliest == nullptr || thread->deadline < earliest->deadline)) {
      earliest = thread.get();
    }
  }
  if (ready == 0) {
    if (earliest == nullptr || earliest->deadline == kNever) {
      std::string words = "every thread waits without a deadline:";
      for (const auto& thread : state->threads) {
        if (!thread->is_over) {
          words += " " + std::to_string(thread->number);
        }
      }
      state->schedule.on_deadlock(words);
    }
    state->now = earliest->deadline;
    return *earliest;
  }
  std::size_t chosen = ready == 1 ? 0 : state->random.below(ready);
  for (const auto& thread : state->threads) {
    if (may_run(*thread) && chosen-- == 0) {
      return *thread;
    }
  }
  std::abort();
}

void give_turn() {
  Thread& next = pick();
  if (&next != me) {
    resume(next);
    await_turn(*me);
  }
  me->came_in_time = me->is_ready;
  me->is_ready = true;
  me->waits_for = nullptr;
  me->deadline = kNever;
}

void* run_thread(void* given) {
  auto& thread = *static_cast<Thread*>(given);
  me = &thread;
  await_turn(thread);
  void* result = thread.body(thread.argument);
  thread.is_over = true;
  wake(&thread, true);
  me = nullptr;
  resume(pick());
  return result;
}

/// Threads of libraries are not simulated.
bool is_of_library(const void* code) {
  Dl_info info = {};
  Dl_info own = {};
  return ::dladdr(code, &info) != 0 &&
         ::dladdr(reinterpret_cast<const void*>(&is_of_library), &own) != 0 &&
         info.dli_fbase != own.dli_fbase &&
         std::string(info.dli_fname).find("libstdc++") == std::string::npos;
}

}  // namespace

std::uint64_t Random::next() {
  std::uint64_t z = (state_ += 0x9e3779b97f4a7c15U);
  z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27U)) * 0x94d049bb133111ebU;
  return z ^ (z >> 31U);
}

double Random::uniform() { return static_cast<double>(next() >> 11U) * 0x1p-53; }

double Random::exponential(double mean) { return -mean * std::log1p(-uniform()); }

void begin(Schedule schedule) {
  state = new State(std::move(schedule));  // Lives as long as the process.
  auto first = std::make_unique<Thread>();
  Thread* thread = first.get();
  state->threads.push_back(std::move(first));
  me = thread;
}

bool is_simulated() { return me != nullptr; }
Nanoseconds now() { return state->now; }
Nanoseconds unix_now() { return kUnixStart + state->now + state->jumped; }
void jump_clock(Nanoseconds by) {
  count_fault(Fault::kClockJumped);
  state->jumped += by;
}
Random& randomness() { return state->random; }

Undisturbed::Undisturbed() {
  if (me != nullptr) {
    ++me->undisturbed;
  }
}
Undisturbed::~Undisturbed() {
  if (me != nullptr) {
    --me->undisturbed;
  }
}

int create_thread(pthread_t* thread, const pthread_attr_t* attributes, void* (*body)(void*),
                  void* argument) {
  if (is_of_library(reinterpret_cast<const void*>(body))) {
    return real::pthread_create(thread, attributes, body, argument);
  }
  auto made = std::make_unique<Thread>();
  Thread& added = *made;
  added.number = ++state->started;
  added.body = body;
  added.argument = argument;
  std::erase_if(state->threads, [](const auto& each) { return each->is_over && each->real == 0; });
  state->threads.push_back(std::move(made));
  const int failed = real::pthread_create(thread, attributes, &run_thread, &added);
  added.real = failed == 0 ? *thread : pthread_t{};
  added.is_over = failed != 0;
  return failed;
}

void wait_for_end(pthread_t thread) {
  for (const auto& each : state->threads) {
    if (each->real == thread) {
      while (!each->is_over) {
        wait(each.get(), kNever);
      }
      each->real = {};
      return;
    }
  }
}

void pass() {
  if (me->undisturbed > 0) {
    return;
  }
  if (state->schedule.may_stall && strikes(Fault::kStalled)) {
    sleep_for(static_cast<Nanoseconds>(state->random.exponential(kStallMean)));
  } else if (state->schedule.preempt > 0 && state->random.chance(state->schedule.preempt)) {
    give_turn();
  }
}

bool wait(const void* address, Nanoseconds deadline) {
  me->is_ready = false;
  me->waits_for = address;
  me->deadline = deadline;
  ++state->waiting_for(address);
  give_turn();
  --state->waiting_for(address);
  return me->came_in_time;
}

void wake(const void* address, bool all) {
  if (state->waiting_for(address) == 0) {
    return;
  }
  for (const auto& thread : state->threads) {
    if (!thread->is_ready && thread->waits_for == address) {
      thread->is_ready = true;
      if (!all) {
        return;
      }
    }
  }
}

void sleep_for(Nanoseconds time) {
  if (me != nullptr) {
    wait(nullptr, state->now + std::max<Nanoseconds>(time, 1));
  }
}

Nanoseconds spend_cpu() {
  const double mean = static_cast<double>(state->schedule.slice_mean);
  const auto spent = static_cast<Nanoseconds>(state->random.exponential(mean));
  me->cpu += spent;
  sleep_for(spent);
  return me->cpu;
}

}  // namespace simulation
