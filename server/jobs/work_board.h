/// WorkBoard: units of work that are rendered by other machines, and who has them.
///
/// A unit is some slices of one job. Which samples it holds is fixed when it is made; until its
/// result is in, the task of the job keeps its tiles for it alone. So the film is the ledger: a
/// result is taken once, from the worker that has the unit's lease, and what a crash of this
/// process takes with it is rendered again from the last checkpoint, under other names. The broker
/// only hands names of units out: it may lose any of them, or repeat them.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "api/worker_view.h"
#include "core/base/mutex.h"
#include "core/base/result.h"
#include "queue/units.h"
#include "server/jobs/job.h"
#include "server/jobs/scheduler.h"
#include "server/observe/log.h"

namespace server {

struct WorkOptions {
  double lease_seconds = 15;  ///< Of a unit whose worker makes no progress.
  std::string build;          ///< That workers need to have.
  std::string arithmetic;
  bool has_local_threads = false;  ///< That render what workers can.
};

class WorkBoard {
 public:
  /// scheduler and log outlive it.
  WorkBoard(std::unique_ptr<queue::UnitPublisher> publisher, Scheduler& scheduler, Log& log,
            WorkOptions options);
  ~WorkBoard() { stop(); }
  WorkBoard(const WorkBoard&) = delete;
  WorkBoard& operator=(const WorkBoard&) = delete;
  /// Hands nothing out any more; results are refused.
  void stop();

  /// Errors: kTooManyRequests.
  core::Result<api::WorkerOrders> report(const std::string& worker,
                                         const api::WorkerReport& report);
  /// The unit's slices. Errors: kNotFound, kConflict.
  core::Result<std::string> lease(const std::string& unit, const std::string& worker);
  /// Errors: kNotFound; kConflict when another worker has it; kInvalidArgument for what cannot be
  /// its result.
  core::Status take(const std::string& unit, const std::string& worker, std::string_view result);
  /// fault: empty when it has none. Errors: kNotFound, kConflict.
  core::Status hand_back(const std::string& unit, const std::string& worker,
                         const std::string& fault);
  /// The job, if units of it are open; else null.
  JobPointer job_of_units(const std::string& id) const;
  std::vector<api::WorkerView> workers() const;

  struct Counts {
    int open = 0;  ///< Units.
    std::uint64_t taken = 0;
    std::uint64_t expired = 0;
    std::uint64_t refused = 0;
    bool has_broker = false;
  };
  Counts counts() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Unit {
    std::shared_ptr<RenderRun> run;
    std::vector<core::Slice> slices;
    std::string worker;       ///< That has it; empty: no worker.
    Clock::time_point since;  ///< That it has it, or that it was published.
    Clock::time_point until;  ///< Of the lease.
    double progress = 0;      ///< CPU seconds, as last reported.
    bool is_published = false;
    bool is_busy = false;        ///< Its result is being taken.
    std::set<std::string> lost;  ///< Workers that it was lost with.
  };
  struct Worker {
    api::WorkerView view;
    Clock::time_point seen;
    bool is_draining = false;
  };
  using Units = std::map<std::string, Unit>;

  void run(const std::stop_token& stop);
  void drop_ended();
  /// Units that no worker has go back to the threads of this process while workers cannot get them.
  void drop_waiting();
  void expire_leases();
  void plan();
  void publish();
  bool prepare_broker();
  static void give_back(const Units& units);
  /// The worker has failed the unit: the next one gets it, or its job fails.
  void lose(Units::value_type& unit, const std::string& reason) REQUIRES(mutex_);
  int slots() const REQUIRES(mutex_);
  bool is_live(const Worker& worker) const;
  Clock::duration lease_time() const;
  double report_seconds() const;

  const std::unique_ptr<queue::UnitPublisher> publisher_;
  Scheduler& scheduler_;
  Log& log_;
  const WorkOptions options_;
  const std::string run_name_;                      ///< Units of other processes have other ones.
  std::optional<std::uint64_t> prepared_;           ///< Generation of the link; of run() alone.
  std::string broker_fault_;                        ///< The same.
  Clock::time_point asked_broker_at_;               ///< The same.
  Clock::time_point had_broker_at_ = Clock::now();  ///< The same.
  std::atomic<bool> has_broker_ = false;
  mutable core::Mutex mutex_;
  core::CondVar changed_;
  bool is_news_ GUARDED_BY(mutex_) = false;
  Units units_ GUARDED_BY(mutex_);
  std::deque<std::string> done_ GUARDED_BY(mutex_);  ///< The latest units whose result is in.
  std::map<std::string, Worker> workers_ GUARDED_BY(mutex_);
  std::uint64_t last_unit_ GUARDED_BY(mutex_) = 0;
  std::uint64_t taken_ GUARDED_BY(mutex_) = 0;
  std::uint64_t expired_ GUARDED_BY(mutex_) = 0;
  std::uint64_t refused_ GUARDED_BY(mutex_) = 0;
  std::jthread thread_;
};

}  // namespace server
