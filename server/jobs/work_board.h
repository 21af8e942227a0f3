/// WorkBoard: lends units of work to other machines.
///
/// A unit's samples are fixed when it is created; until its result arrives, the job's task reserves
/// its tiles for it. The film is therefore the ledger: a result is accepted once, from a worker
/// that holds the unit's lease, and results lost in a crash of this process are rendered again from
/// the last checkpoint, under other names. The broker only distributes the names of units, and may
/// lose or repeat them.
///
/// UnitPlanner makes the units; who holds what and who is trusted is decided by LeaseTable. This
/// class gives them the time, a lock, the films and the broker. A job fails for its workers only if
/// a unit was lost by several of them that stopped to report while they rendered it.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "api/answers/worker_view.h"
#include "core/base/mutex.h"
#include "core/base/result.h"
#include "server/jobs/background.h"
#include "server/jobs/job.h"
#include "server/jobs/scheduler.h"
#include "server/jobs/unit_planner.h"
#include "server/observe/log.h"
#include "server/queue/unit_queue.h"
#include "server/workers/lease_table.h"

namespace server {

class WorkBoard {
 public:
  /// Called by the board's thread. reason: why no worker renders the job; empty: it does not wait.
  using NoteWaiting = std::function<void(Job& job, const std::string& reason)>;

  /// Called before the job's film gets an unverified result of the worker.
  using NoteUnverified = std::function<void(Job& job, const std::string& worker)>;

  /// Called when the worker was suspended for wrong results.
  using Distrust = std::function<void(const std::string& worker)>;

  struct Calls {
    NoteWaiting note_waiting;
    NoteUnverified note_unverified;
    Distrust distrust;
  };
  /// scheduler and log must outlive it.
  WorkBoard(std::shared_ptr<queue::UnitQueue> queue, Scheduler& scheduler, Log& log,
            WorkOptions options, Calls calls);
  ~WorkBoard();
  WorkBoard(const WorkBoard&) = delete;
  WorkBoard& operator=(const WorkBoard&) = delete;
  /// Stops leasing units; later results are refused.
  void stop();
  /// As LeaseTable::suspend_again(). Call it before workers report.
  void suspend_again(std::set<std::string> workers);

  using Sender = LeaseTable::Sender;
  using Counts = LeaseTable::Counts;
  /// Errors: as LeaseTable::report().
  core::Result<api::WorkerOrders> report(const Sender& sender, const api::WorkerReport& report);
  /// Returns the unit's slices. Errors: as LeaseTable::lease().
  core::Result<std::string> lease(const std::string& unit, const Sender& sender);
  /// Returns the largest size of the unit's result, in bytes. Errors: as LeaseTable::held().
  core::Result<std::uint64_t> result_bytes_max(const std::string& unit, const Sender& sender) const;
  /// Accepts a result. Errors: as LeaseTable::begin_result(); kInvalidArgument when it cannot be
  /// the unit's result.
  core::Status take(const std::string& unit, const Sender& sender, std::string_view result);
  /// Returns the unit. fault: empty if there is none. Errors: as LeaseTable::held().
  core::Status hand_back(const std::string& unit, const Sender& sender, const std::string& fault);
  /// Returns the job if a worker with that key holds a unit of it; otherwise null.
  JobPointer job_of_lease(const std::string& id, const std::string& key) const;
  std::vector<api::WorkerView> workers() const;
  /// Returns the tiles of the job that workers are rendering; a tile rendered by two workers
  /// appears twice.
  std::vector<api::WorkerTile> tiles_of(const Job& job) const;
  Counts counts() const;

 private:
  using Clock = WorkUnit::Clock;

  // Reads a result sent by a worker.
  core::Result<LeaseTable::Work> read_result(const RenderRun& run,
                                             const std::vector<core::Slice>& slices,
                                             std::string_view result) const;
  /// Adds the work to the film, and removes the unit.
  void accept(const std::string& unit, RenderRun& run, LeaseTable::Work work);
  /// Renders the unit in this process.
  void render_here(const std::string& unit) REQUIRES(mutex_);
  /// work: empty if it was stopped.
  void take_own(const std::string& unit, std::optional<LeaseTable::Work> work);
  /// Wakes the board's thread.
  void wake() REQUIRES(mutex_);

  // Body of the board's thread.
  void run(const std::stop_token& stop);
  void drop_ended();
  void note_waiting_jobs();
  /// Returns units that no worker holds to the threads of this process while workers cannot get
  /// them.
  void drop_waiting();
  void expire_leases();
  void render_hopeless();
  void plan();
  void find_lost_messages();
  void note_queue_fault(const core::Error& fault);
  void publish();
  void request_reports();
  bool prepare_broker();
  static void give_back(const LeaseTable::Units& units);

  const std::shared_ptr<queue::UnitQueue> queue_;
  Scheduler& scheduler_;
  Log& log_;
  const WorkOptions options_;
  const Calls calls_;
  // This and the following members are used only by run().
  UnitPlanner planner_;
  std::optional<std::uint64_t> prepared_;  ///< Generation of the link.
  std::string broker_fault_;
  Clock::time_point had_broker_at_ = options_.now();
  Clock::time_point had_workers_at_ = options_.now();
  Clock::time_point noted_at_;
  std::vector<std::weak_ptr<Job>> warned_;
  std::atomic<bool> has_broker_ = false;
  mutable core::Mutex mutex_;
  core::CondVar changed_;
  bool is_news_ GUARDED_BY(mutex_) = false;
  LeaseTable table_ GUARDED_BY(mutex_);
  Background own_;  ///< Renders units of this process.
  std::jthread thread_;
};

}  // namespace server
