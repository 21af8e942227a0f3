// Plays lives of a server, each in a process of its own, until the days are over or an invariant
// does not hold.
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <string>
#include <string_view>

#include <execinfo.h>
#include <sched.h>
#include <sys/personality.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/simulation/damage.h"
#include "tests/simulation/faults.h"
#include "tests/simulation/life.h"
#include "tests/simulation/model.h"

namespace {

using simulation::Ending;
using simulation::kHour;
using simulation::kSecond;
using simulation::Ledger;
using simulation::Life;

constexpr const char* kUsage =
    "usage: simulation [--seed N] [--seeds COUNT] [--days D] [--trace] [--twice]\n"
    "                  [--real] [--fresh SECONDS] [--faults]\n";
/// Real time after which a life counts as stuck.
constexpr unsigned kStuckSeconds = 300;
/// Chances of a flipped bit at each start.
constexpr double kLogDamage = 0.2;
constexpr double kFilmDamage = 0.1;

struct Options {
  std::uint64_t seed = 1;
  std::uint64_t seeds = 1;
  double days = 1;
  double fresh_seconds = 0;  ///< Seeds that follow from the time are played for so long; 0: not.
  bool trace = false;
  bool twice = false;
  bool faults = false;  ///< Every kind of fault must happen once a day on average.
  bool real = false;    ///< The real renderer renders, which takes longer.
};

/// Prints where the process died, and dies.
void print_stack(int number) {
  std::array<void*, 64> frames{};
  ::backtrace_symbols_fd(frames.data(), ::backtrace(frames.data(), static_cast<int>(frames.size())),
                         STDOUT_FILENO);
  std::signal(number, SIG_DFL);
  std::raise(number);
}

/// Runs `play` in a process of its own; returns its wait status.
template <typename Play>
int run_apart(const Play& play) {
  std::fflush(stdout);
  const pid_t child = ::fork();
  if (child == 0) {
    ::alarm(kStuckSeconds);
    for (const int number : {SIGSEGV, SIGABRT, SIGALRM}) {
      std::signal(number, &print_stack);
    }
    play();
    ::_exit(1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return status;
}

std::string words_of(int status) {
  if (WIFSIGNALED(status)) {
    return WTERMSIG(status) == SIGALRM
               ? "a life is stuck"
               : std::string("the server died: ") + ::strsignal(WTERMSIG(status));
  }
  return "a life ended with the code " + std::to_string(WEXITSTATUS(status));
}

void print_trace(const Ledger& ledger, std::size_t lines) {
  for (const std::string& line : ledger.last_lines(lines)) {
    std::printf("  %s\n", line.c_str());
  }
}

/// Flips a bit, sometimes, while no server runs.
void damage(Life& life, Ledger& ledger) {
  simulation::Random random(life.seed * 104'729 + life.number);
  const std::string data = life.root + "/data";
  life.expects_damage = random.chance(kLogDamage) && simulation::damage_log(data, random);
  if (!life.expects_damage && random.chance(kFilmDamage)) {
    if (const std::string job = simulation::damage_film(data, random); !job.empty()) {
      ledger.note(0, "damaged " + job);
      ledger.note(0, "faults film-damaged 1");
    }
  }
}

using FaultCounts = std::array<std::uint64_t, simulation::kFaultNames.size()>;

/// Prints how often each kind of fault happened. Returns whether each did once a day.
bool check_faults(const FaultCounts& counts, double days) {
  bool is_fine = true;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const bool is_rare = static_cast<double>(counts[i]) < days;
    std::printf("%8llu %s%s\n", static_cast<unsigned long long>(counts[i]),
                std::string(simulation::kFaultNames[i]).c_str(),
                is_rare ? ": less than once a day" : "");
    is_fine = is_fine && !is_rare;
  }
  return is_fine;
}

/// Returns whether every invariant holds. faults: counts what happened.
bool play_seed(std::uint64_t seed, const Options& options, const std::filesystem::path& folder,
               FaultCounts& faults) {
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder / "disk");
  Ledger ledger((folder / "trace").string());
  Life life{.root = (folder / "undisturbed").string(), .is_faulty = false};
  std::filesystem::create_directories(life.root);
  int status = run_apart([&] { simulation::render_undisturbed(life, ledger); });
  ledger.catch_up();
  life = {.root = (folder / "disk").string(), .seed = seed};
  const auto end = static_cast<simulation::Nanoseconds>(options.days * 24 * kHour);
  bool is_fine = WIFEXITED(status) && WEXITSTATUS(status) == 0;
  while (is_fine && life.start < end) {
    ++life.number;
    status = run_apart([&] { simulation::live(life, ledger); });
    ledger.catch_up();
    is_fine =
        WIFEXITED(status) && WEXITSTATUS(status) < static_cast<int>(Ending::kViolation) &&
        (WEXITSTATUS(status) == 0 || WEXITSTATUS(status) >= static_cast<int>(Ending::kKilled));
    life.start = ledger.time() + kSecond;
    if (life.expects_damage) {  // What was acknowledged may be lost.
      std::filesystem::remove_all(life.root);
      std::filesystem::create_directories(life.root);
      ledger.note(0, "fresh");
    }
    damage(life, ledger);
  }
  for (std::size_t i = 0; i < faults.size(); ++i) {
    faults[i] += ledger.count("fault " + std::string(simulation::kFaultNames[i]));
  }
  if (!is_fine) {
    std::printf("seed %llu, life %llu: %s\n", static_cast<unsigned long long>(seed),
                static_cast<unsigned long long>(life.number), words_of(status).c_str());
    print_trace(ledger, options.trace ? SIZE_MAX : 40);
    std::printf("replay: tests/simulation/run --seed %llu --days %g --trace%s\n",
                static_cast<unsigned long long>(seed), options.days, options.real ? " --real" : "");
  } else {
    std::printf(
        "seed %llu: %.1f days, %llu lives, %llu jobs, %llu answers\n",
        static_cast<unsigned long long>(seed),
        static_cast<double>(life.start) / static_cast<double>(24 * kHour),
        static_cast<unsigned long long>(life.number),
        static_cast<unsigned long long>(ledger.count("ok-submit")),
        static_cast<unsigned long long>(ledger.count("ok-cancel") + ledger.count("ok-pause") +
                                        ledger.count("ok-resume") + ledger.count("ok-extend") +
                                        ledger.count("ok-remove") + ledger.count("ok-rank")));
    if (options.trace) {
      print_trace(ledger, SIZE_MAX);
    }
  }
  std::fflush(stdout);
  return is_fine;
}

/// One processor: threads take turns, and a turn is passed faster there. The same addresses in
/// every run.
void settle_process(char** arguments) {
  const int now = ::personality(0xffffffff);
  if ((now & ADDR_NO_RANDOMIZE) == 0 &&
      ::personality(static_cast<unsigned long>(now) | ADDR_NO_RANDOMIZE) != -1) {
    ::setenv("GLIBC_TUNABLES", "glibc.malloc.arena_max=1", 1);
    ::execv("/proc/self/exe", arguments);
  }
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(static_cast<std::size_t>(::sched_getcpu()), &one);
  ::sched_setaffinity(0, sizeof one, &one);
}

}  // namespace

int main(int count, char** arguments) {
  Options options;
  for (int i = 1; i < count; ++i) {
    const std::string_view name = arguments[i];
    const char* value = i + 1 < count ? arguments[i + 1] : nullptr;
    if (name == "--trace") {
      options.trace = true;
    } else if (name == "--real") {
      options.real = true;
      simulation::render_really();
    } else if (name == "--faults") {
      options.faults = true;
    } else if (name == "--twice") {
      options.twice = true;
    } else if (name == "--seed" && value != nullptr) {
      options.seed = std::strtoull(arguments[++i], nullptr, 10);
    } else if (name == "--seeds" && value != nullptr) {
      options.seeds = std::strtoull(arguments[++i], nullptr, 10);
    } else if (name == "--fresh" && value != nullptr) {
      options.fresh_seconds = std::strtod(arguments[++i], nullptr);
      options.seed = static_cast<std::uint64_t>(std::time(nullptr));
    } else if (name == "--days" && value != nullptr) {
      options.days = std::strtod(arguments[++i], nullptr);
    } else {
      std::fputs(kUsage, stderr);
      return 2;
    }
  }
  settle_process(arguments);
  const std::filesystem::path memory = "/dev/shm";
  const auto folder = (is_directory(memory) ? memory : std::filesystem::temp_directory_path()) /
                      ("tessera-simulation-" + std::to_string(::getpid()));
  std::uint64_t failed = 0;
  FaultCounts faults{};
  std::uint64_t played = 0;
  const auto start = std::chrono::steady_clock::now();
  const auto goes_on = [&](std::uint64_t seeds) {
    const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
    return options.fresh_seconds > 0 ? time.count() < options.fresh_seconds : seeds < options.seeds;
  };
  for (std::uint64_t i = 0; failed == 0 && goes_on(i); ++i) {
    failed += play_seed(options.seed + i, options, folder, faults) ? 0U : 1U;
    ++played;
    if (options.twice && failed == 0) {
      const auto lines = Ledger((folder / "trace").string()).last_lines(SIZE_MAX);
      failed += play_seed(options.seed + i, options, folder, faults) ? 0U : 1U;
      ++played;
      if (lines != Ledger((folder / "trace").string()).last_lines(SIZE_MAX)) {
        std::puts("the same seed gave another trace");
        ++failed;
      }
    }
  }
  std::filesystem::remove_all(folder);
  if (options.faults && failed == 0 &&
      !check_faults(faults, options.days * static_cast<double>(played))) {
    ++failed;
  }
  return failed == 0 ? 0 : 1;
}
