/// WorkBoard: units of work that are rendered by other machines, and who has them.
///
/// A unit is some slices of one job. Which samples it holds is fixed when it is made; until its
/// result is in, the task of the job keeps its tiles for it alone. So the film is the ledger: a
/// result is taken once, from a worker that has the unit's lease, and what a crash of this
/// process takes with it is rendered again from the last checkpoint, under other names. The broker
/// only hands names of units out: it may lose any of them, or repeat them.
///
/// Two workers may have the same unit: a set share of them, whose results have to be equal, and the
/// last ones of a pass, where the first result wins.
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

#include "api/worker_view.h"
#include "core/base/mutex.h"
#include "core/base/result.h"
#include "server/jobs/scheduler.h"
#include "server/jobs/work_options.h"
#include "server/jobs/work_unit.h"
#include "server/observe/log.h"
#include "server/queue/units.h"

namespace server {

class WorkBoard {
 public:
  /// Called by the board's thread. waits: there is no worker that can render the job.
  using NoteWaiting = std::function<void(Job& job, bool waits)>;

  /// scheduler and log outlive it.
  WorkBoard(std::unique_ptr<queue::UnitPublisher> publisher, Scheduler& scheduler, Log& log,
            WorkOptions options, NoteWaiting note_waiting);
  ~WorkBoard() { stop(); }
  WorkBoard(const WorkBoard&) = delete;
  WorkBoard& operator=(const WorkBoard&) = delete;
  /// Hands nothing out any more; results are refused.
  void stop();

  /// Errors: kTooManyRequests.
  core::Result<api::WorkerOrders> report(const std::string& worker,
                                         const api::WorkerReport& report);
  /// The unit's slices. Errors: kNotFound; kConflict when others have it; kUnavailable when others
  /// are to have it.
  core::Result<std::string> lease(const std::string& unit, const std::string& worker);
  /// Bytes that the unit's result has at most. Errors: kNotFound, kConflict as take().
  core::Result<std::uint64_t> result_bytes_max(const std::string& unit,
                                               const std::string& worker) const;
  /// Errors: kNotFound when it is in already, or not wanted any more; kConflict when another worker
  /// has it; kUnavailable while another's result is being taken; kInvalidArgument for what cannot
  /// be its result.
  core::Status take(const std::string& unit, const std::string& worker, std::string_view result);
  /// fault: empty when it has none. Errors: kNotFound, kConflict.
  core::Status hand_back(const std::string& unit, const std::string& worker,
                         const std::string& fault);
  /// The job, if units of it are open; else null.
  JobPointer job_of_units(const std::string& id) const;
  std::vector<api::WorkerView> workers() const;
  /// Of the job, those that workers render now; a tile that two of them render is there twice.
  std::vector<api::WorkerTile> tiles_of(const Job& job) const;

  struct Counts {
    int open = 0;  ///< Units.
    std::uint64_t taken = 0;
    std::uint64_t expired = 0;
    std::uint64_t refused = 0;
    std::uint64_t doubled = 0;   ///< For the end of a pass.
    std::uint64_t verified = 0;  ///< Rendered by two workers, with equal results.
    std::uint64_t differing = 0;
    bool has_broker = false;
  };
  Counts counts() const;

 private:
  using Clock = WorkUnit::Clock;
  struct Worker {
    api::WorkerView view;
    Clock::time_point seen;
    bool is_draining = false;
    double samples = 0;  ///< Of its results.
    double seconds = 0;  ///< That it had their leases.
  };
  using Units = std::map<std::string, WorkUnit>;
  using Failures = std::vector<std::pair<std::shared_ptr<RenderRun>, std::string>>;

  // For workers.
  core::Result<std::vector<core::SliceWork>> read_result(const RenderRun& run,
                                                         const std::vector<core::Slice>& slices,
                                                         std::string_view result) const;
  /// The work goes into the film now; empty: it waits for another worker's, or does not equal it.
  std::optional<std::vector<core::SliceWork>> settle(Units::value_type& unit,
                                                     const std::string& worker,
                                                     std::vector<core::SliceWork> work,
                                                     Failures& failures) REQUIRES(mutex_);
  void note_result(WorkUnit& unit, const std::string& worker, std::size_t bytes) REQUIRES(mutex_);
  /// The worker has failed the unit: the next one gets it, or its job fails.
  void lose(Units::value_type& unit, const std::string& worker, const std::string& reason)
      REQUIRES(mutex_);
  void tell() REQUIRES(mutex_);
  /// Takes the unit off the board. Its workers are asked to report, and learn of it.
  Units::node_type remove(Units::const_iterator unit) REQUIRES(mutex_);
  /// Errors: kNotFound when no such unit is open, kConflict when the worker has no lease on it.
  core::Status check_lease(const std::string& unit, const std::string& worker) const
      REQUIRES(mutex_);

  // Of the thread.
  void run(const std::stop_token& stop);
  void drop_ended();
  void note_waiting_jobs();
  /// Units that no worker has go back to the threads of this process while workers cannot get them.
  void drop_waiting();
  void expire_leases();
  /// What was to be verified, where no other worker is left to do it.
  void take_unverified();
  void plan();
  bool plan_one(int slots);
  void double_last_units();
  void publish();
  void request_reports();
  bool prepare_broker();
  static void give_back(const Units& units);
  static void fail(const Failures& failures);

  bool works(const Worker& worker) const;
  int slots() const REQUIRES(mutex_);
  std::map<std::string, int> leases() const REQUIRES(mutex_);  ///< By worker.
  bool is_live(const Worker& worker) const;
  Clock::duration lease_time() const;
  double report_seconds() const;

  const std::unique_ptr<queue::UnitPublisher> publisher_;
  Scheduler& scheduler_;
  Log& log_;
  const WorkOptions options_;
  const NoteWaiting note_waiting_;
  const std::string run_name_;                       ///< Units of other processes have other ones.
  std::optional<std::uint64_t> prepared_;            ///< Generation of the link; of run() alone.
  std::string broker_fault_;                         ///< The same.
  Clock::time_point had_broker_at_ = Clock::now();   ///< The same.
  Clock::time_point had_workers_at_ = Clock::now();  ///< The same.
  Clock::time_point noted_at_;                       ///< The same.
  std::vector<std::weak_ptr<Job>> warned_;           ///< The same.
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
  std::jthread thread_;
};

}  // namespace server
