// `tessera worker`: renders units of a server's jobs, which it takes from the server's queue.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <memory>
#include <mutex>
#include <random>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>
#include <pthread.h>

#include "clients/cli/command.h"
#include "clients/cli/patience.h"
#include "clients/cli/shown.h"
#include "clients/worker/pauses.h"
#include "clients/worker/worker_jobs.h"
#include "core/accel/arithmetic.h"
#include "core/base/build_id.h"
#include "core/base/cgroup.h"
#include "core/render/units/slice_work.h"
#include "server/queue/units.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;
using nlohmann::json;
using Clock = std::chrono::steady_clock;

/// How long an idle thread waits for the broker; also the delay with which it notices a stop.
constexpr std::chrono::milliseconds kPull{500};
/// Delay with which signals and orders are noticed.
constexpr std::chrono::milliseconds kTick{50};

/// Time to return unfinished parts after the grace period: of several requests to a busy server.
constexpr std::chrono::seconds kReturn{5};

struct WorkerFlags {
  ServerFlags server;
  queue::Address queue;
  int threads = 0;
  std::string cache;
  std::uint64_t cache_bytes = std::uint64_t{10} << 30U;
  double idle_seconds = 0;
  double grace_seconds = 30;
  std::string isa = "native";
};

double seconds_of(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Clock::duration to_duration(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

std::string random_id() {
  std::random_device random;
  std::string id;
  for (int i = 0; i < 4; ++i) {
    char digits[9];
    std::snprintf(digits, sizeof digits, "%08x", random());
    id += digits;
  }
  return id;
}

std::string default_cache() {
  const char* cache = std::getenv("XDG_CACHE_HOME");
  const char* home = std::getenv("HOME");
  const std::string base = cache != nullptr && *cache != '\0' ? std::string(cache)
                           : home != nullptr && *home != '\0' ? std::string(home) + "/.cache"
                                                              : "/var/cache";
  return base + "/tessera/worker";
}

/// A unit that a thread is processing.
struct Held {
  std::string name;
  const queue::UnitPuller::Unit* unit = nullptr;
  clockid_t clock{};     ///< Time that shows progress: CPU time of the process while the job is
                         ///< loaded, then of the thread; real time while the result is sent, which
                         ///< may wait for the network or for the server's memory
  double start = 0;      ///< of that clock
  double spent = 0;      ///< before the clock was switched
  double reported = -1;  ///< as last reported
  std::stop_source stop;

  double progress() const { return spent + seconds_of(clock) - start; }
  void switch_to(clockid_t next) {
    spent = progress();
    clock = next;
    start = seconds_of(clock);
  }
};

class Worker {
 public:
  Worker(const WorkerFlags& flags, std::shared_ptr<queue::NatsLink> link, std::string isa)
      : flags_(flags),
        link_(std::move(link)),
        id_(random_id()),
        arithmetic_(core::arithmetic_class(isa)),
        threads_(flags.threads > 0 ? flags.threads : core::usable_threads()),
        jobs_({.folder = flags.cache,
               .folder_bytes_max = flags.cache_bytes,
               .threads = threads_,
               .isa = flags.isa == "native" ? std::string() : isa}) {}

  /// Runs until a signal stops it, or until it has been idle for the idle time.
  int run(const sigset_t& signals);

 private:
  using Server = std::unique_ptr<ApiClient>;
  Server connect() const {
    auto made = ApiClient::connect(flags_.server.url, flags_.server.key);
    return made ? *std::move(made) : nullptr;  // The flags have checked the address.
  }
  void work();
  /// pauses: after failed requests for leases.
  void do_unit(const queue::UnitPuller::Unit& unit, ApiClient& server, Pauses& pauses);
  /// The server may have leased the unit even if it did not answer.
  void return_unit(const queue::UnitPuller::Unit& unit, ApiClient& server);
  /// Errors: why the unit is returned.
  core::Result<std::string> render(Held& held, const std::string& input, ApiClient& server);
  /// Errors: kUnavailable if it was stopped before the server's response; why the server refuses
  /// the result.
  core::Status deliver(Held& held, const std::string& result, ApiClient& server);
  void hand_back(const std::string& name, const std::string& fault, ApiClient& server) const;
  void keep_reporting(const std::stop_token& stop);
  /// Returns the time until the next report.
  double report(ApiClient& server);
  bool is_idle();

  const WorkerFlags flags_;
  const std::shared_ptr<queue::NatsLink> link_;
  const std::string id_;
  const std::string arithmetic_;
  const int threads_;
  WorkerJobs jobs_;
  std::atomic<bool> is_suitable_ = false;
  std::atomic<bool> is_draining_ = false;
  std::stop_source drained_;  ///< of is_draining_, for threads that wait to ask again
  std::string told_;          ///< the latest complaint; used by the reporting thread
  std::mutex mutex_;
  std::vector<Held*> held_;                // guarded by mutex_
  Clock::time_point busy_ = Clock::now();  // guarded by mutex_
};

bool Worker::is_idle() {
  const std::lock_guard lock(mutex_);
  return flags_.idle_seconds > 0 && held_.empty() &&
         std::chrono::duration<double>(Clock::now() - busy_).count() > flags_.idle_seconds;
}

double Worker::report(ApiClient& server) {
  json units = json::object();
  {
    const std::lock_guard lock(mutex_);
    for (Held* held : held_) {
      const double progress = held->progress();
      units[held->name] = progress;
      if (progress > held->reported) {
        held->unit->renew();
      }
      held->reported = progress;
    }
  }
  const json body = {{"build", core::linker_build_id()},
                     {"arithmetic", arithmetic_},
                     {"threads", threads_},
                     {"draining", is_draining_.load()},
                     {"units", std::move(units)}};
  const auto reply = server.put("/v1/workers/" + id_, body.dump(), "application/json");
  const auto tell = [this](const std::string& text) {
    if (text != told_ && !text.empty()) {
      std::fprintf(stderr, "tessera worker: %s\n", shown(text).c_str());
    }
    told_ = text;
  };
  constexpr double kAskAgainSeconds = std::chrono::duration<double>(kAskAgain).count();
  if (!reply) {
    tell(reply.error().message);
    is_suitable_ = false;
    return kAskAgainSeconds;
  }
  const json orders = json::parse(reply->body, nullptr, false);
  if (!orders.is_object() || !orders.contains("suitable") || !orders.contains("dropped")) {
    tell("the server's response is invalid");
    return kAskAgainSeconds;
  }
  is_suitable_ = orders["suitable"] == true;
  tell(is_suitable_ ? "" : "it gets no units: " + orders.value("reason", ""));
  const std::lock_guard lock(mutex_);
  for (const json& name : orders["dropped"]) {
    for (Held* held : held_) {
      if (name == held->name) {
        held->stop.request_stop();
      }
    }
  }
  return orders.value("report_seconds", kAskAgainSeconds);
}

void Worker::work() {
  const Server server = connect();
  queue::UnitPuller puller(link_);
  Pauses pauses;
  while (!is_draining_) {
    if (!is_suitable_) {
      std::this_thread::sleep_for(kTick);
      continue;
    }
    if (const auto unit = puller.next(kPull)) {
      do_unit(*unit, *server, pauses);
    }
  }
}

void Worker::return_unit(const queue::UnitPuller::Unit& unit, ApiClient& server) {
  bool is_held = false;  // by another thread, which got the name in an earlier message
  {
    const std::lock_guard lock(mutex_);
    is_held = std::any_of(held_.begin(), held_.end(),
                          [&](const Held* held) { return held->name == unit.name(); });
  }
  if (!is_held && server.last().status != 503) {
    hand_back(unit.name(), "", server);
  }
  unit.hand_back();
}

void Worker::do_unit(const queue::UnitPuller::Unit& unit, ApiClient& server, Pauses& pauses) {
  if (is_draining_) {
    unit.hand_back();
    return;
  }
  const auto input = server.post("/v1/work/units/" + unit.name() + "/lease",
                                 json{{"worker", id_}}.dump(), "application/json");
  if (!input && input.error().code == ErrorCode::kUnavailable) {
    // A server that is not busy says so, and that the unit is meant for another worker.
    const bool is_others = server.last().status == 503 && server.last().retry_after_seconds == 0;
    const std::chrono::milliseconds pause = is_others ? kAskAgain : pauses.next(server.last());
    return_unit(unit, server);
    wait(pause, drained_.get_token());
    return;
  }
  pauses.reset();
  if (!input) {  // It is done, or another worker holds it.
    unit.done();
    return;
  }
  Held held;
  held.name = unit.name();
  held.unit = &unit;
  held.clock = CLOCK_PROCESS_CPUTIME_ID;
  held.start = seconds_of(held.clock);
  {
    const std::lock_guard lock(mutex_);
    held_.push_back(&held);
  }
  const auto result = render(held, input->body, server);
  const core::Status delivered =
      result ? deliver(held, *result, server) : core::Status(result.error());
  if (!delivered) {
    // Dropped by the server, at the end of the grace time, or with its job: not a fault.
    const bool is_dropped =
        held.stop.stop_requested() || delivered.error().code == ErrorCode::kNotFound;
    hand_back(held.name, is_dropped ? "" : delivered.error().message, server);
  }
  unit.done();
  const std::lock_guard lock(mutex_);
  std::erase(held_, &held);
  busy_ = Clock::now();
}

core::Result<std::string> Worker::render(Held& held, const std::string& input, ApiClient& server) {
  try {
    auto work = core::decode_work(input, core::WorkPart::kInput);
    if (!work) {
      return work.error();
    }
    const auto renderer =
        jobs_.renderer(held.name.substr(0, held.name.find('.')), server, held.stop.get_token());
    if (!renderer) {
      return renderer.error();
    }
    {
      clockid_t own{};
      pthread_getcpuclockid(pthread_self(), &own);
      const std::lock_guard lock(mutex_);
      held.switch_to(own);
    }
    if (!(*renderer)->render(*work, held.stop.get_token())) {
      return Error{ErrorCode::kCancelled, "stopped", ""};
    }
    return core::encode_work(*work, core::WorkPart::kResult);
  } catch (const std::exception& error) {
    return Error{ErrorCode::kInternal, error.what(), ""};
  }
}

core::Status Worker::deliver(Held& held, const std::string& result, ApiClient& server) {
  {
    const std::lock_guard lock(mutex_);
    held.switch_to(CLOCK_MONOTONIC);
  }
  const auto put = keep_trying(server, held.stop.get_token(), [&] {
    return server.put("/v1/work/units/" + held.name + "/results/" + id_, result,
                      "application/octet-stream");
  });
  // 404 and 409: the result is in the film, perhaps by an earlier attempt, or no longer needed.
  const bool is_taken =
      put || put.error().code == ErrorCode::kNotFound || put.error().code == ErrorCode::kConflict;
  return is_taken ? core::ok_status() : core::Status(put.error());
}

void Worker::hand_back(const std::string& name, const std::string& fault, ApiClient& server) const {
  constexpr std::size_t kFaultCharacters = 200;
  if (!fault.empty()) {
    std::fprintf(stderr, "tessera worker: %s: %s\n", name.c_str(), shown(fault).c_str());
  }
  // If the server does not receive it, the lease expires.
  static_cast<void>(
      server.post("/v1/work/units/" + name + "/hand-back",
                  json{{"worker", id_}, {"fault", fault.substr(0, kFaultCharacters)}}.dump(
                      -1, ' ', false, json::error_handler_t::replace),
                  "application/json"));
}

void Worker::keep_reporting(const std::stop_token& stop) {
  const Server server = connect();
  queue::ReportRequests requests(link_, id_);
  Clock::time_point next{};
  bool was_draining = false;
  while (!stop.stop_requested()) {
    const bool is_news = is_draining_ != was_draining;
    if (requests.take() || is_news || Clock::now() >= next) {
      was_draining = is_draining_;
      next = Clock::now() + to_duration(report(*server));
    }
    std::this_thread::sleep_for(kTick);
  }
  report(*server);
}

int Worker::run(const sigset_t& signals) {
  std::printf("worker %s\n", id_.c_str());
  std::fflush(stdout);
  std::vector<std::jthread> threads;
  std::atomic<int> working = threads_;
  for (int i = 0; i < threads_; ++i) {
    threads.emplace_back([this, &working] {
      work();
      --working;
    });
  }
  std::atomic<bool> is_reporting = true;
  std::jthread reports([this, &is_reporting](const std::stop_token& stop) {
    keep_reporting(stop);
    is_reporting = false;
  });
  Clock::time_point end{};
  // Requests may hang for longer than the grace period, so this thread makes none.
  while (is_reporting) {
    constexpr timespec kWait{.tv_sec = 0, .tv_nsec = std::chrono::nanoseconds(kTick).count()};
    const bool is_told = sigtimedwait(&signals, nullptr, &kWait) > 0;
    if ((is_told || is_idle()) && !is_draining_.exchange(true)) {
      drained_.request_stop();
      end = Clock::now() + to_duration(flags_.grace_seconds);
    }
    if (working == 0) {
      reports.request_stop();
    }
    if (is_draining_ && Clock::now() > end) {
      const std::lock_guard lock(mutex_);
      for (Held* held : held_) {
        held->stop.request_stop();
      }
    }
    if (is_draining_ && Clock::now() > end + kReturn) {
      std::fprintf(stderr,
                   "tessera worker: %s does not respond; it gives the parts to other workers when "
                   "their leases expire\n",
                   flags_.server.url.c_str());
      std::fflush(stderr);
      std::_Exit(kFailed);  // Threads are still waiting for responses.
    }
  }
  return kDone;
}

int start(const WorkerFlags& flags) {
  const auto isa = core::resolve_isa(flags.isa);
  if (!isa) {
    return complain("worker", {isa.error().code, isa.error().message, "--isa"});
  }
  // This thread takes signals by sigtimedwait(); all others inherit the mask.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
  auto link = queue::NatsLink::open(flags.queue, "tessera worker");
  if (!link) {
    return complain("worker", {link.error().code, link.error().message, "--queue"});
  }
  return Worker(flags, *std::move(link), *isa).run(signals);
}

}  // namespace

int worker(const Args& args) {
  WorkerFlags flags;
  flags.cache = default_cache();
  CLI::App app(
      "Renders parts of the images of a server that was started with --queue. Joins and leaves at "
      "any\ntime: after SIGTERM it finishes its parts.",
      "tessera worker");
  app.add_option("--queue", flags.queue.url, "NATS server that distributes the parts")
      ->envname("TESSERA_QUEUE")
      ->required()
      ->check(CLI::Validator(
          [](const std::string& url) {
            const auto place = queue::host_and_port(url);
            return place ? std::string() : place.error().message;
          },
          ""))
      ->type_name("URL");
  app.add_option("--queue-creds", flags.queue.credentials, "Credentials (JWT and seed) for --queue")
      ->envname("TESSERA_QUEUE_CREDS")
      ->type_name("FILE");
  app.add_option("--queue-ca", flags.queue.ca,
                 "CA certificates (PEM) that verify the server of --queue")
      ->envname("TESSERA_QUEUE_CA")
      ->type_name("FILE");
  add_server_flags(app, flags.server);
  app.add_option("--threads", flags.threads,
                 "Concurrent parts; 0: as many as the machine has cores")
      ->envname("TESSERA_THREADS")
      ->capture_default_str()
      ->check(within(0, 1024))
      ->type_name("N");
  app.add_option("--cache", flags.cache,
                 "Folder for cached scene files, kept in its subfolder tessera-inputs")
      ->envname("TESSERA_CACHE")
      ->default_str("$XDG_CACHE_HOME/tessera/worker")
      ->type_name("DIR");
  app.add_option("--cache-size", flags.cache_bytes,
                 "Maximum size of the cache; the oldest files are removed first")
      ->envname("TESSERA_CACHE_SIZE")
      ->default_str("10G")
      ->transform(CLI::AsSizeValue(false))
      ->type_name("BYTES");
  app.add_option("--idle", flags.idle_seconds, "Exit after this time without work; 0: never")
      ->envname("TESSERA_IDLE")
      ->capture_default_str()
      ->check(within(0, 1e9))
      ->type_name("SECONDS");
  app.add_option("--grace", flags.grace_seconds,
                 "Time after SIGTERM to finish parts; others are returned, which takes 5 s at most")
      ->envname("TESSERA_GRACE")
      ->capture_default_str()
      ->check(within(0, 3600))
      ->type_name("SECONDS");
  app.add_option(
         "--isa", flags.isa,
         "Limit Embree to an instruction set: native, sse2, sse4.2, avx, avx2, avx512, neon")
      ->envname("TESSERA_ISA")
      ->capture_default_str()
      ->type_name("NAME");
  return parse_and_run(app, args, [&] { return start(flags); });
}

}  // namespace cli
