// Plays lives of a server, each in a process of its own, until the days are over or an invariant
// does not hold.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <new>
#include <string>
#include <string_view>

#include <execinfo.h>
#include <sys/mman.h>
#include <sys/personality.h>
#include <sys/wait.h>
#include <unistd.h>

#include "server/routes/page.h"
#include "tests/simulation/copier.h"
#include "tests/simulation/damage.h"
#include "tests/simulation/faults.h"
#include "tests/simulation/life.h"
#include "tests/simulation/model.h"
#include "tests/simulation/requests.h"

namespace {

using simulation::Ending;
using simulation::Fault;
using simulation::kDay;
using simulation::kFaults;
using simulation::kRequests;
using simulation::kSecond;
using simulation::Ledger;
using simulation::Life;

constexpr const char* kUsage =
    "usage: simulation [--seed N] [--seeds COUNT] [--days D] [--jobs J] [--trace] [--twice]\n"
    "                  [--real] [--fresh SECONDS] [--counts]\n";
/// Real time after which a life counts as stuck.
constexpr unsigned kStuckSeconds = 300;

struct Options {
  std::uint64_t seed = 1;
  std::uint64_t seeds = 1;
  double days = 1;           ///< Of each seed.
  int jobs = 1;              ///< Processes that share the days, each with a seed of its own.
  double fresh_seconds = 0;  ///< Seeds that follow from the time are played for so long; 0: not.
  bool trace = false;
  bool twice = false;
  bool counts = false;  ///< All that is played must happen once a day on average.
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
  life.expects_damage =
      random.chance(chance_at_start(Fault::kLogDamaged)) && simulation::damage_log(data, random);
  if (!life.expects_damage && random.chance(chance_at_start(Fault::kFilmDamaged))) {
    if (const std::string job = simulation::damage_film(data, random); !job.empty()) {
      ledger.note(0, "damaged " + job);
      ledger.note(0, "faults film-damaged 1");
    }
  }
}

/// What has happened: faults, then requests that were carried out. Shared by processes.
struct Counts {
  std::array<std::atomic<std::uint64_t>, kFaults.size() + kRequests.size()> of = {};
  std::atomic<int> failed = 0;
};

/// Prints how often each kind happened. Returns whether each did once a day.
bool check_counts(const Counts& counts, double days) {
  bool is_fine = true;
  for (std::size_t i = 0; i < counts.of.size(); ++i) {
    const std::string name(i < kFaults.size() ? kFaults[i].name : kRequests[i - kFaults.size()]);
    const bool is_rare = static_cast<double>(counts.of[i]) < days;
    std::printf("%8llu %s%s\n", static_cast<unsigned long long>(counts.of[i]), name.c_str(),
                is_rare ? ": less than once a day" : "");
    is_fine = is_fine && !is_rare;
  }
  return is_fine;
}

/// Returns whether every invariant holds.
bool play_seed(std::uint64_t seed, const Options& options, const simulation::Copier& copier,
               const std::filesystem::path& folder, Counts& counts) {
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder / "disk");
  Ledger ledger((folder / "trace").string());
  Life life{.root = (folder / "undisturbed").string(), .is_faulty = false};
  std::filesystem::create_directories(life.root);
  int status = run_apart([&] { simulation::render_undisturbed(life, ledger); });
  ledger.catch_up();
  life = {.copier = &copier, .root = (folder / "disk").string(), .seed = seed};
  const auto end = static_cast<simulation::Nanoseconds>(options.days * kDay);
  bool is_fine = WIFEXITED(status) && WEXITSTATUS(status) == 0;
  while (is_fine && life.start < end) {
    ++life.number;
    status = run_apart([&] { simulation::live(life, ledger); });
    ledger.catch_up();
    is_fine =
        WIFEXITED(status) && WEXITSTATUS(status) < static_cast<int>(Ending::kViolation) &&
        (WEXITSTATUS(status) == 0 || WEXITSTATUS(status) >= static_cast<int>(Ending::kKilled));
    life.start = ledger.time() + kSecond;
    life.build += WEXITSTATUS(status) == static_cast<int>(Ending::kUpgraded) ? 1 : 0;
    if (life.expects_damage) {  // What was acknowledged may be lost.
      std::filesystem::remove_all(life.root);
      std::filesystem::create_directories(life.root);
      ledger.note(0, "fresh");
    }
    damage(life, ledger);
  }
  for (std::size_t i = 0; i < counts.of.size(); ++i) {
    counts.of[i] += i < kFaults.size()
                        ? ledger.count("fault " + std::string(kFaults[i].name))
                        : ledger.count("ok-" + std::string(kRequests[i - kFaults.size()]));
  }
  std::uint64_t requests = 0;
  for (const std::string_view name : kRequests) {
    requests += ledger.count("ok-" + std::string(name));
  }
  if (!is_fine) {
    std::printf("seed %llu, life %llu: %s\n", static_cast<unsigned long long>(seed),
                static_cast<unsigned long long>(life.number), words_of(status).c_str());
    print_trace(ledger, options.trace ? SIZE_MAX : 40);
    std::printf("replay: tests/simulation/run --seed %llu --days %g --trace%s\n",
                static_cast<unsigned long long>(seed), options.days, options.real ? " --real" : "");
  } else {
    std::printf("seed %llu: %.1f days, %llu lives, %llu requests of %llu jobs\n",
                static_cast<unsigned long long>(seed),
                static_cast<double>(life.start) / static_cast<double>(kDay),
                static_cast<unsigned long long>(life.number),
                static_cast<unsigned long long>(requests),
                static_cast<unsigned long long>(ledger.count("ok-submit")));
    if (options.trace) {
      print_trace(ledger, SIZE_MAX);
    }
  }
  std::fflush(stdout);
  return is_fine;
}

/// The same addresses in every run, and memory that is not given back.
void settle_process(char** arguments) {
  const int now = ::personality(0xffffffff);
  if ((now & ADDR_NO_RANDOMIZE) == 0 &&
      ::personality(static_cast<unsigned long>(now) | ADDR_NO_RANDOMIZE) != -1) {
    ::setenv("GLIBC_TUNABLES",
             "glibc.malloc.arena_max=1:glibc.malloc.mmap_threshold=1073741824:"
             "glibc.malloc.trim_threshold=1073741824:glibc.malloc.top_pad=67108864:"
             "glibc.malloc.hugetlb=1",
             1);
    ::execv("/proc/self/exe", arguments);
  }
}

/// Plays the seeds of one of the processes; returns their number.
std::uint64_t play_seeds(const Options& options, int job, Counts& counts) {
  const std::filesystem::path memory = "/dev/shm";
  const auto folder = (is_directory(memory) ? memory : std::filesystem::temp_directory_path()) /
                      ("tessera-simulation-" + std::to_string(::getpid()));
  const auto start = std::chrono::steady_clock::now();
  const auto goes_on = [&](std::uint64_t seeds) {
    const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
    return options.fresh_seconds > 0 ? time.count() < options.fresh_seconds : seeds < options.seeds;
  };
  const simulation::Copier copier;
  std::uint64_t played = 0;
  for (std::uint64_t i = 0; counts.failed == 0 && goes_on(i); ++i) {
    const auto jobs = static_cast<std::uint64_t>(options.jobs);
    const std::uint64_t seed = options.seed + i * jobs + static_cast<std::uint64_t>(job);
    counts.failed += play_seed(seed, options, copier, folder, counts) ? 0 : 1;
    ++played;
    if (options.twice && counts.failed == 0) {
      const auto lines = Ledger((folder / "trace").string()).last_lines(SIZE_MAX);
      counts.failed += play_seed(seed, options, copier, folder, counts) ? 0 : 1;
      ++played;
      if (lines != Ledger((folder / "trace").string()).last_lines(SIZE_MAX)) {
        std::puts("the same seed gave another trace");
        ++counts.failed;
      }
    }
  }
  std::filesystem::remove_all(folder);
  return played;
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
    } else if (name == "--counts") {
      options.counts = true;
    } else if (name == "--twice") {
      options.twice = true;
    } else if (name == "--seed" && value != nullptr) {
      options.seed = std::strtoull(arguments[++i], nullptr, 10);
    } else if (name == "--seeds" && value != nullptr) {
      options.seeds = std::strtoull(arguments[++i], nullptr, 10);
    } else if (name == "--fresh" && value != nullptr) {
      options.fresh_seconds = std::strtod(arguments[++i], nullptr);
      options.seed = static_cast<std::uint64_t>(std::time(nullptr));
    } else if (name == "--jobs" && value != nullptr) {
      options.jobs = std::max(1, std::atoi(arguments[++i]));
    } else if (name == "--days" && value != nullptr) {
      options.days = std::strtod(arguments[++i], nullptr);
    } else {
      std::fputs(kUsage, stderr);
      return 2;
    }
  }
  settle_process(arguments);
  server::page_files();  // Decompressed here once, not in each life.
  options.days /= options.jobs;
  void* shared =
      ::mmap(nullptr, sizeof(Counts), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  auto& counts = *new (shared) Counts;
  std::uint64_t played = 0;
  if (options.jobs == 1) {
    played = play_seeds(options, 0, counts);
  } else {
    std::fflush(stdout);
    for (int job = 0; job < options.jobs; ++job) {
      if (::fork() == 0) {
        play_seeds(options, job, counts);
        ::_exit(0);
      }
    }
    for (int status = 0; ::wait(&status) > 0;) {
      counts.failed += status == 0 ? 0 : 1;
    }
    played = options.seeds * static_cast<std::uint64_t>(options.jobs);
  }
  if (options.counts && counts.failed == 0 &&
      !check_counts(counts, options.days * static_cast<double>(played))) {
    return 1;
  }
  return counts.failed == 0 ? 0 : 1;
}
