/// WorkBoard: units of work rendered by other machines, and the workers that hold them.
///
/// A unit is a set of slices of one job. Its samples are fixed when it is created; until its result
/// arrives, the job's task reserves its tiles for it. The film is therefore the ledger: a result is
/// accepted once, from a worker that holds the unit's lease, and results lost in a crash of this
/// process are rendered again from the last checkpoint, under other names. The broker only
/// distributes the names of units, and may lose or repeat them.
///
/// Two workers may hold the same unit: for a configured share of units, whose two results must be
/// equal, and for the last units of a pass, where the first result is taken.
///
/// Faults are counted by worker. A worker that fails a unit rests, each time in a row for twice as
/// long, and does not get that unit again while there are others. If two results differ, or no
/// worker is left that has not failed a unit, this process renders it. The worker whose result
/// differs from its own is suspended until it is restarted, and what the film holds of it is
/// rendered again. A job fails for its workers only if a unit was lost by several of them that
/// stopped to report while they rendered it.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "api/answers/worker_view.h"
#include "core/base/mutex.h"
#include "core/base/result.h"
#include "server/jobs/background.h"
#include "server/jobs/scheduler.h"
#include "server/jobs/work_options.h"
#include "server/jobs/work_unit.h"
#include "server/observe/log.h"
#include "server/queue/units.h"

namespace server {

class WorkBoard {
 public:
  /// Called by the board's thread. reason: why no worker renders the job; empty: it does not wait.
  using NoteWaiting = std::function<void(Job& job, const std::string& reason)>;

  /// Called when results of a suspended worker are in the job's film without having been verified.
  using Distrust = std::function<void(const JobPointer& job)>;

  struct Calls {
    NoteWaiting note_waiting;
    Distrust distrust;
  };
  /// scheduler and log must outlive it.
  WorkBoard(std::unique_ptr<queue::UnitPublisher> publisher, Scheduler& scheduler, Log& log,
            WorkOptions options, Calls calls);
  ~WorkBoard() { stop(); }
  WorkBoard(const WorkBoard&) = delete;
  WorkBoard& operator=(const WorkBoard&) = delete;
  /// Stops leasing units; later results are refused.
  void stop();

  /// Who sends a request. A worker's id belongs to the key that reported it first; requests with
  /// other keys fail with kForbidden.
  struct Sender {
    std::string worker;
    std::string key;  ///< Id of the key.
  };
  /// Errors: kTooManyRequests.
  core::Result<api::WorkerOrders> report(const Sender& sender, const api::WorkerReport& report);
  /// Returns the unit's slices. Errors: kNotFound; kConflict when other workers hold it;
  /// kUnavailable when it is intended for other workers.
  core::Result<std::string> lease(const std::string& unit, const Sender& sender);
  /// Returns the largest size of the unit's result, in bytes. Errors: kNotFound, kConflict as
  /// take().
  core::Result<std::uint64_t> result_bytes_max(const std::string& unit, const Sender& sender) const;
  /// Accepts a result. Errors: kNotFound when the unit has a result already or is no longer needed;
  /// kConflict when another worker holds it; kUnavailable while another result is being taken;
  /// kInvalidArgument when it cannot be the unit's result.
  core::Status take(const std::string& unit, const Sender& sender, std::string_view result);
  /// Returns the unit. fault: empty if there is none. Errors: kNotFound, kConflict.
  core::Status hand_back(const std::string& unit, const Sender& sender, const std::string& fault);
  /// Returns the job if a worker with that key holds a unit of it; otherwise null.
  JobPointer job_of_lease(const std::string& id, const std::string& key) const;
  std::vector<api::WorkerView> workers() const;
  /// Returns the tiles of the job that workers are rendering; a tile rendered by two workers
  /// appears twice.
  std::vector<api::WorkerTile> tiles_of(const Job& job) const;

  struct Counts {
    int open = 0;  ///< Open units.
    std::uint64_t taken = 0;
    std::uint64_t expired = 0;
    std::uint64_t refused = 0;
    std::uint64_t doubled = 0;   ///< Units given to a second worker at the end of a pass.
    std::uint64_t verified = 0;  ///< Units rendered by two workers with equal results.
    std::uint64_t differing = 0;
    std::uint64_t suspended = 0;  ///< Workers suspended for wrong results.
    std::uint64_t own = 0;        ///< Units rendered by this process after workers failed.
    bool has_broker = false;
  };
  Counts counts() const;

 private:
  using Clock = WorkUnit::Clock;
  struct Worker {
    api::WorkerView view;
    std::string key;  ///< Id of the key that reported it.
    Clock::time_point seen;
    bool is_draining = false;
    double samples = 0;             ///< In its results.
    double seconds = 0;             ///< During which it held their leases.
    std::string unsuitable;         ///< Why; empty: it is suitable.
    std::string suspended;          ///< Why; empty: it is not.
    int failures = 0;               ///< In a row.
    Clock::time_point rests_until;  ///< After its last failure.
    std::string last_fault;
    std::vector<std::weak_ptr<Job>> unverified;  ///< Jobs that took results of it unverified.
  };
  using Units = std::map<std::string, WorkUnit>;
  using Failures = std::vector<std::pair<std::shared_ptr<RenderRun>, std::string>>;

  // Reads a result sent by a worker.
  core::Result<std::vector<core::SliceWork>> read_result(const RenderRun& run,
                                                         const std::vector<core::Slice>& slices,
                                                         std::string_view result) const;
  /// Returns the slices to add to the film; empty if the result waits for, or differs from, another
  /// worker's.
  std::optional<std::vector<core::SliceWork>> settle(Units::value_type& unit,
                                                     const std::string& worker,
                                                     std::vector<core::SliceWork> work)
      REQUIRES(mutex_);
  void note_result(WorkUnit& unit, const std::string& worker, std::size_t bytes) REQUIRES(mutex_);
  // Faults and disputes: work_trust.cpp.
  enum class Fault {
    kLost,    ///< It did not report in time.
    kRefused  ///< It returned the unit with a reason, or its result is invalid.
  };
  /// Handles a unit that a worker has failed: the worker rests, and another one gets the unit.
  void fail_unit(Units::value_type& unit, const std::string& worker, Fault fault,
                 const std::string& reason) REQUIRES(mutex_);
  /// Returns why the worker gets no units now; empty: it gets some.
  std::string why_idle(const Worker& worker) const;
  /// Returns whether a worker that has not failed the unit could get it, or renders it.
  bool has_hope(const WorkUnit& unit) const REQUIRES(mutex_);
  void note_unverified(const std::string& worker, const RenderRun& run) REQUIRES(mutex_);
  /// Renders units here that workers cannot.
  void render_hopeless();
  void render_here(Units::value_type& unit) REQUIRES(mutex_);
  /// work: empty if it was stopped.
  void take_own(const std::string& unit, std::optional<std::vector<core::SliceWork>> work);
  /// Returns the jobs that took results of it unverified.
  std::vector<JobPointer> suspend(const std::string& worker, const std::string& reason)
      REQUIRES(mutex_);
  void tell() REQUIRES(mutex_);
  /// Takes the unit off the board. Its workers are asked to report, and learn of it.
  Units::node_type remove(Units::const_iterator unit) REQUIRES(mutex_);
  core::Status check_key(const Sender& sender) const REQUIRES(mutex_);
  /// Errors: kNotFound when no such unit is open, kConflict when the worker has no lease on it.
  core::Status check_lease(const std::string& unit, const Sender& sender) const REQUIRES(mutex_);
  /// Returns whether the sender rendered or renders the unit already. The two results of a verified
  /// unit come from different keys too, while workers with other keys are connected.
  bool has_part_in(const WorkUnit& unit, const Sender& sender) const REQUIRES(mutex_);

  // Body of the board's thread.
  void run(const std::stop_token& stop);
  void drop_ended();
  void note_waiting_jobs();
  /// Returns units that no worker holds to the threads of this process while workers cannot get
  /// them.
  void drop_waiting();
  void expire_leases();
  /// Accepts unverified results of units that no other worker is left to verify.
  void take_unverified();
  void plan();
  bool plan_one(int slots);
  void double_last_units();
  void find_lost_messages();
  void note_queue_fault(const core::Error& fault);
  void publish();
  void request_reports();
  bool prepare_broker();
  static void give_back(const Units& units);
  static void fail(const Failures& failures);

  bool works(const Worker& worker) const;
  int slots() const REQUIRES(mutex_);
  std::map<std::string, int> leases() const REQUIRES(mutex_);  ///< Leases by worker.
  bool is_live(const Worker& worker) const;
  Clock::duration lease_time() const;
  double report_seconds() const;

  const std::unique_ptr<queue::UnitPublisher> publisher_;
  Scheduler& scheduler_;
  Log& log_;
  const WorkOptions options_;
  const Calls calls_;
  const std::string run_name_;             ///< Distinguishes units from those of other processes.
  std::optional<std::uint64_t> prepared_;  ///< Generation of the link. This and the following
                                           ///< members are used only by run().
  std::string broker_fault_;
  Clock::time_point had_broker_at_ = Clock::now();
  Clock::time_point had_workers_at_ = Clock::now();
  Clock::time_point noted_at_;
  std::vector<std::weak_ptr<Job>> warned_;
  std::atomic<bool> has_broker_ = false;
  mutable core::Mutex mutex_;
  core::CondVar changed_;
  bool is_news_ GUARDED_BY(mutex_) = false;
  Units units_ GUARDED_BY(mutex_);
  std::map<std::string, Worker> workers_ GUARDED_BY(mutex_);
  std::set<std::string> to_report_ GUARDED_BY(mutex_);  ///< workers with units that were removed
  std::uint64_t last_unit_ GUARDED_BY(mutex_) = 0;
  Counts counts_ GUARDED_BY(mutex_);
  std::mt19937_64 chance_ GUARDED_BY(mutex_){std::random_device()()};
  Background own_;  ///< Renders units of this process.
  std::jthread thread_;
};

}  // namespace server
