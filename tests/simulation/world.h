/// World: a life as its threads see it. life.cpp: its start, tenants and end; operators.cpp: what
/// operators do, and what holds at rest.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <unistd.h>

#include "api/job/job_spec.h"
#include "tests/simulation/disk.h"
#include "tests/simulation/faults.h"
#include "tests/simulation/life.h"
#include "tests/simulation/requests.h"
#include "tests/simulation/server.h"
#include "tests/simulation/workers.h"

namespace simulation {

using api::JobState;
using server::Access;
using server::JobPointer;

/// Nothing fails from this time of a shift on, and clients only wait for their jobs.
inline constexpr Nanoseconds kCalm = 5 * kHour;
/// Every job has ended at this time of a shift.
inline constexpr Nanoseconds kNight = kCalm + kHour;
inline constexpr Nanoseconds kTick = 30 * kSecond;  ///< Between two decisions of the operator.

/// A life as its threads see it.
class World {
 public:
  World(const Life& life, Ledger& ledger)
      : life_(life),
        ledger_(ledger),
        requests_(server_, ledger, [this](const std::string& words) { fail(words); }) {}

  [[noreturn]] void end(Ending ending) {
    note_faults();
    ledger_.note(0, "end " + std::to_string(static_cast<int>(ending)) + " operations " +
                        std::to_string(disk_operations()));
    shorten_files();
    ::_exit(static_cast<int>(ending));
  }
  [[noreturn]] void fail(const std::string& words) {
    note_faults();
    ledger_.note(0, "VIOLATION " + words);
    ::_exit(static_cast<int>(Ending::kViolation));
  }
  void begin(bool is_quick);
  void start();
  [[noreturn]] void play();
  [[noreturn]] void render_all();

 private:
  void note_faults() {
    if (const std::string faults = fault_counts(); !faults.empty()) {
      ledger_.note(0, "faults " + faults);
    }
  }
  void play_tenant(int tenant);
  void act(int tenant, Random& random);
  api::ParsedJob parsed(int kind, int samples, int retention_seconds = 0) {
    auto request = api::parse_job(body_of(kind, samples, retention_seconds));
    if (!request) {
      fail("a request is refused: " + api::problem_json(request.problem(), ""));
    }
    return *std::move(request);
  }
  void submit(int tenant, const std::string& id);
  void watch(int tenant, const std::string& id, const JobPointer& job, Random& random);
  void retry(int tenant, const std::string& id, const JobPointer& job);
  /// Waits until the job is forgotten, if it is to be soon.
  void expire(int tenant, const std::string& id, const JobPointer& job);
  void compare(int tenant, const std::string& id, const JobPointer& job);
  /// Cancels the job; then, perhaps, removes it and uses its id again.
  void cancel(int tenant, const std::string& id, const JobPointer& job, Random& random);
  /// Returns the job if it is there; checks that it is as it was acknowledged.
  JobPointer look(int tenant, const std::string& id);
  void check_view(const std::string& id, const KnownJob& known, const api::JobView& view);
  void take_call(const server::WebPost& post);
  void check_calls(const std::string& id, const server::Job& job);
  void check_events(int tenant, const std::string& id, const JobPointer& job);
  void check_film(const std::string& id, const JobPointer& job);
  void note_answer(int tenant, const std::string& verb, const std::string& id,
                   const server::Verdict& verdict);
  void ask(int tenant, const std::string& verb, const std::string& id,
           const std::string& more = "") {
    ledger_.note(tenant, "ask-" + verb + " " + id + (more.empty() ? "" : " " + more));
  }
  std::vector<std::string> ids_of(int tenant);
  Nanoseconds time_of_shift() const { return now() % kShift; }
  bool is_calm() const { return time_of_shift() >= kCalm; }
  bool is_night() const { return time_of_shift() >= kNight; }
  void operate(Random& random);
  void check_keys(bool is_unreadable);
  void use_keys(Random& random);
  void settle(int tenant, Random& random);
  void play_floods();
  void back_up();
  void cancel_hanging(int tenant, const std::vector<std::string>& resumed);
  void check_rest();
  void reload();

  const Life& life_;
  Ledger& ledger_;
  Server server_;
  Requests requests_;
  double think_seconds_ = 120;
  Nanoseconds step_ = 0;  ///< Mean time of a slice and of a sync.
  int reloads_ = 0;
  bool may_stall_ = false;
  bool is_full_ = false;
  bool was_full_ = false;  ///< Some events are in memory only.
  bool is_draining_ = false;
  std::optional<std::uint64_t> workers_seed_;  ///< Empty: there are no workers.
  std::optional<Workers> workers_;
  bool is_broker_up_ = true;
  std::set<std::string> paused_;  ///< Ids of jobs that this process was asked to pause.
  std::vector<bool> is_settled_ = std::vector<bool>(kTenants + 1, false);
};

}  // namespace simulation
