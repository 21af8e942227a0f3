#include "tests/simulation/executor.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csetjmp>
#include <cstring>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include <cxxabi.h>
#include <dlfcn.h>
#include <sys/mman.h>
#include <sys/single_threaded.h>
#include <ucontext.h>
#include <unistd.h>

#include "tests/simulation/faults.h"
#include "tests/simulation/real.h"

namespace simulation {
namespace {

/// 2026-01-01.
constexpr Nanoseconds kUnixStart = 1767225600 * kSecond;

constexpr double kStallMean = 5.0 * kSecond;

/// The default of the C library, of which a thread touches a few pages.
constexpr std::size_t kStackBytes = std::size_t{8} << 20U;
/// Exceptions that a thread handles: Itanium C++ ABI, exception handling, 2.2.2.
constexpr std::size_t kHandledBytes = 2 * sizeof(void*);

struct Thread {
  std::size_t number = 0;
  ucontext_t start = {};    ///< Where it begins.
  std::jmp_buf place = {};  ///< Where it goes on, once it has begun.
  bool has_begun = false;
  void* stack = nullptr;  ///< null: that of the process
  std::array<std::byte, kHandledBytes> handled = {};
  int error = 0;  ///< errno
  bool is_ready = true;
  bool is_over = false;
  bool came_in_time = false;
  const void* waits_for = nullptr;
  Nanoseconds deadline = kNever;
  Nanoseconds cpu = 0;
  int undisturbed = 0;
  bool is_joined = false;
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
  std::vector<void*> stacks;  ///< Of threads that have ended.
  std::size_t started = 0;
  /// Threads that wait for addresses of that hash: most locks are waited for by none.
  std::array<std::uint16_t, 1024> waiting = {};
  std::uint16_t& waiting_for(const void* address) {
    return waiting[(reinterpret_cast<std::uintptr_t>(address) >> 3U) % waiting.size()];
  }
};

State* state = nullptr;
Thread* me = nullptr;  ///< Whose turn it is.
thread_local bool is_main = false;

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

/// Goes on with another thread.
void switch_to(Thread& next) {
  Thread& before = *me;
  std::memcpy(before.handled.data(), abi::__cxa_get_globals(), kHandledBytes);
  before.error = errno;
  me = &next;
  if (::_setjmp(before.place) == 0) {  // swapcontext() would ask the kernel for signals each time.
    if (std::exchange(next.has_begun, true)) {
      ::_longjmp(next.place, 1);
    }
    ::setcontext(&next.start);
  }
  std::memcpy(abi::__cxa_get_globals(), me->handled.data(), kHandledBytes);
  errno = me->error;
}

void give_turn() {
  if (Thread& next = pick(); &next != me) {
    switch_to(next);
  }
  me->came_in_time = me->is_ready;
  me->is_ready = true;
  me->waits_for = nullptr;
  me->deadline = kNever;
}

/// The first function of a thread.
void run_thread() {
  std::memset(abi::__cxa_get_globals(), 0, kHandledBytes);
  me->body(me->argument);
  me->is_over = true;
  wake(me, true);
  switch_to(pick());
}

void* new_stack() {
  if (!state->stacks.empty()) {
    void* stack = state->stacks.back();
    state->stacks.pop_back();
    return stack;
  }
  void* stack = ::mmap(nullptr, kStackBytes, PROT_READ | PROT_WRITE,
                       MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_STACK, -1, 0);
  if (stack != MAP_FAILED) {
    ::mprotect(stack, static_cast<std::size_t>(::getpagesize()), PROT_NONE);
  }
  return stack;
}

/// Gives back the stacks of threads that have ended and are joined.
void bury() {
  std::erase_if(state->threads, [](const auto& thread) {
    const bool is_gone = thread->is_over && thread->is_joined;
    if (is_gone) {
      state->stacks.push_back(thread->stack);
    }
    return is_gone;
  });
}

Thread* thread_of(pthread_t thread) {
  for (const auto& each : state->threads) {
    if (reinterpret_cast<pthread_t>(each.get()) == thread) {
      return each.get();
    }
  }
  return nullptr;
}

/// Threads of libraries are not simulated.
bool is_of_library(const void* code) {
  static std::map<const void*, bool> known;
  const auto [found, is_new] = known.try_emplace(code, false);
  Dl_info info = {};
  Dl_info own = {};
  if (is_new) {
    found->second = ::dladdr(code, &info) != 0 &&
                    ::dladdr(reinterpret_cast<const void*>(&is_of_library), &own) != 0 &&
                    info.dli_fbase != own.dli_fbase &&
                    std::string(info.dli_fname).find("libstdc++") == std::string::npos;
  }
  return found->second;
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
  state->threads.push_back(std::make_unique<Thread>());
  me = state->threads.back().get();
  me->has_begun = true;
  is_main = true;
  __libc_single_threaded = 0;  // Else the standard library leaves out what threads wait for.
}

bool is_simulated() { return is_main; }
Nanoseconds now() { return state->now; }
Nanoseconds unix_now() { return kUnixStart + state->now + state->jumped; }
void jump_clock(Nanoseconds by) {
  count_fault(Fault::kClockJumped);
  state->jumped += by;
}
Random& randomness() { return state->random; }

Undisturbed::Undisturbed() {
  if (is_main) {
    ++me->undisturbed;
  }
}
Undisturbed::~Undisturbed() {
  if (is_main) {
    --me->undisturbed;
  }
}

int create_thread(pthread_t* thread, const pthread_attr_t* attributes, void* (*body)(void*),
                  void* argument) {
  if (is_of_library(reinterpret_cast<const void*>(body))) {
    return real::pthread_create(thread, attributes, body, argument);
  }
  bury();
  void* stack = new_stack();
  if (stack == MAP_FAILED) {
    return EAGAIN;
  }
  state->threads.push_back(std::make_unique<Thread>());
  Thread& added = *state->threads.back();
  added.number = ++state->started;
  added.body = body;
  added.argument = argument;
  added.stack = stack;
  ::getcontext(&added.start);
  added.start.uc_stack.ss_sp = stack;
  added.start.uc_stack.ss_size = kStackBytes;
  ::makecontext(&added.start, &run_thread, 0);
  *thread = reinterpret_cast<pthread_t>(&added);
  return 0;
}

int thread_number() { return static_cast<int>(me->number); }

pthread_t own_number() { return reinterpret_cast<pthread_t>(me); }

std::span<std::byte> stack_of(pthread_t thread) {
  const Thread* const found = thread_of(thread);
  return found == nullptr || found->stack == nullptr
             ? std::span<std::byte>()
             : std::span(static_cast<std::byte*>(found->stack), kStackBytes);
}

bool wait_for_end(pthread_t thread) {
  Thread* const ending = thread_of(thread);
  if (ending == nullptr) {
    return false;
  }
  while (!ending->is_over) {
    wait(ending, kNever);
  }
  ending->is_joined = true;
  return true;
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
  if (is_main) {
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
