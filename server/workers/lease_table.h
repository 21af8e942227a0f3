/// LeaseTable: which worker renders which unit of work, and which workers are trusted with any.
///
/// A unit is a set of slices of one job. Two workers may hold the same unit: for a configured share
/// of units, whose two results must be equal, and for the last units of a pass, where the first
/// result is taken.
///
/// Faults are counted by worker. A worker that fails a unit rests, each time in a row for twice as
/// long, and does not get that unit again while there are others. If two results differ, or no
/// worker is left to render or verify a unit, the coordinator renders it. The worker whose result
/// differs from the coordinator's is suspended until it is restarted: a worker has another id then.
///
/// It has no threads, no lock, no clock and no chance of its own: it is given a seed, each call is
/// given the time, and the caller locks (WorkBoard).
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "api/answers/worker_view.h"
#include "core/base/result.h"
#include "server/observe/log.h"
#include "server/workers/work_options.h"
#include "server/workers/work_unit.h"

namespace server {

class LeaseTable {
 public:
  using Time = WorkUnit::Clock::time_point;
  using Units = std::map<std::string, WorkUnit>;  ///< By name.
  using Work = std::vector<core::SliceWork>;

  /// Who sends a request. A worker's id belongs to the key that reported it first; requests with
  /// other keys fail with kForbidden.
  struct Sender {
    std::string worker;
    std::string key;  ///< Id of the key.
  };
  struct Counts {
    int open = 0;  ///< Open units.
    std::uint64_t taken = 0;
    std::uint64_t expired = 0;
    std::uint64_t refused = 0;
    std::uint64_t doubled = 0;   ///< Units given to a second worker at the end of a pass.
    std::uint64_t verified = 0;  ///< Units rendered twice with equal results.
    std::uint64_t differing = 0;
    std::uint64_t suspended = 0;  ///< Workers suspended for wrong results.
    std::uint64_t own = 0;        ///< Units that this process rendered itself.
    bool has_broker = false;      ///< Set by WorkBoard.
  };

  /// options and log must outlive it. seed: draws the units that are verified; workers must not
  /// know it.
  LeaseTable(const WorkOptions& options, Log& log, std::uint64_t seed)
      : options_(options), log_(log), chance_(seed) {}

  /// Time between two reports of a worker.
  double report_seconds() const;
  const Units& units() const { return units_; }
  Counts counts() const;

  // Workers.

  /// Errors: kTooManyRequests, kForbidden. unix_seconds: the same time, for readers.
  core::Result<api::WorkerOrders> report(const Sender& sender, const api::WorkerReport& report,
                                         Time now, double unix_seconds);
  std::size_t worker_count() const { return workers_.size(); }
  /// Returns the threads of the workers that get units now.
  int slots(Time now) const;
  std::vector<api::WorkerView> workers(Time now) const;
  /// Returns whether the worker reported with this key.
  bool has_key(const std::string& worker, const std::string& key) const;
  /// Returns the workers whose units were removed since the last call: they should report at once.
  std::set<std::string> take_to_report() { return std::exchange(to_report_, {}); }

  // Units, as workers ask for them.

  /// Adds a unit; decides whether it is verified.
  void add(const std::string& name, WorkUnit unit, Time now);
  /// Leases the unit. Errors: kNotFound; kConflict when other workers hold it; kUnavailable when it
  /// is intended for other workers.
  core::Result<const WorkUnit*> lease(const std::string& name, const Sender& sender, Time now);
  /// Returns the unit if the sender holds it. Errors: kForbidden, kNotFound, kConflict.
  core::Result<const WorkUnit*> held(const std::string& name, const Sender& sender) const;
  /// The same, and reserves it until refuse_result(), take_result() or cancel(). Errors: also
  /// kUnavailable while another result is being taken.
  core::Result<const WorkUnit*> begin_result(const std::string& name, const Sender& sender);
  /// Ends a reservation without a result, for a reason that is not the worker's.
  void cancel(const std::string& name);
  /// The result is invalid.
  void refuse_result(const std::string& name, const std::string& worker, const std::string& reason,
                     Time now);
  struct Taken {
    std::optional<Work> work;  ///< To be added to the film, and then close(). Empty: the result
                               ///< waits for another worker's, or differs from it.
    bool is_disputed = false;  ///< The two results differ: the caller renders the unit.
  };
  /// Errors: kNotFound when the unit was removed meanwhile, by clear(); kConflict when the worker
  /// has lost it.
  core::Result<Taken> take_result(const std::string& name, const std::string& worker, Work work,
                                  std::size_t bytes, Time now);
  /// Returns the unit to the table. fault: empty if there is none. Errors: as held().
  core::Status hand_back(const std::string& name, const Sender& sender, const std::string& fault,
                         Time now);
  /// Removes a unit whose result is in the film. Its other workers are asked to report.
  void close(const std::string& name);

  // Units that the coordinator renders.

  /// Reserves the unit for it, until close() or cancel().
  void begin_own(const std::string& name);
  /// Suspends the workers whose results differ from this one, the coordinator's, and returns them.
  std::vector<std::string> judge(const std::string& name, const std::string& digest);
  /// Suspends workers that an earlier process has suspended.
  void suspend_again(std::set<std::string> workers) { suspended_.merge(workers); }
  /// Returns the units that no worker is left to render or, after one has, to verify.
  std::vector<std::string> hopeless(Time now) const;

  // What passes with time, and planning.

  /// Takes leases from workers that have not reported in time, and forgets silent ones. Returns the
  /// units that too many workers were lost with.
  std::vector<const WorkUnit*> expire(Time now);
  /// Removes and returns the units for which is_unneeded; their workers are asked to report. A
  /// reserved one stays, and the coordinator stops rendering it.
  Units remove_if(const std::function<bool(const WorkUnit&)>& is_unneeded);
  /// Removes all.
  Units clear() { return std::exchange(units_, {}); }
  /// Returns the number of further leases that the units need.
  int wanted() const;
  /// Gives the longest-running units to idle workers too.
  void double_last_units(Time now);

  // Messages of the broker.

  /// Returns the names to publish, one for each further worker that a unit needs.
  std::vector<std::string> take_to_publish(Time now);
  /// The stream is new and empty.
  void forget_messages();
  /// Returns the number of messages that the stream should have, if a unit has waited for two
  /// leases since it was published.
  std::optional<std::uint64_t> messages_expected(Time now) const;
  /// Publishes the names of late units again if messages are missing, else waits once more.
  void note_messages(bool is_any_missing, Time now);

 private:
  struct Worker {
    api::WorkerView view;
    std::string key;  ///< Id of the key that reported it.
    Time seen;
    bool is_draining = false;
    double samples = 0;      ///< In its results.
    double seconds = 0;      ///< During which it held their leases.
    std::string unsuitable;  ///< Why; empty: it is suitable.
    int failures = 0;        ///< In a row.
    Time rests_until;        ///< After its last failure.
    std::string last_fault;
  };
  enum class Fault {
    kLost,    ///< It did not report in time.
    kRefused  ///< It returned the unit with a reason, or its result is invalid.
  };
  core::Status check_key(const Sender& sender) const;
  /// Returns whether the sender rendered or renders the unit already. The two results of a verified
  /// unit come from different keys too, while workers with other keys are connected.
  bool has_part_in(const WorkUnit& unit, const Sender& sender, Time now) const;
  void note_result(WorkUnit& unit, const std::string& worker, std::size_t bytes, Time now);
  /// Handles a unit that a worker has failed: the worker rests, and another one gets the unit.
  void fail_unit(Units::value_type& unit, const std::string& worker, Fault fault,
                 const std::string& reason, Time now);
  /// Returns false if it was suspended before.
  bool suspend(const std::string& worker);
  /// Returns why the worker gets no units now; empty: it gets some.
  std::string why_idle(const Worker& worker, Time now) const;
  bool is_live(const Worker& worker, Time now) const {
    return now - worker.seen < options_.lease_time();
  }
  bool works(const Worker& worker, Time now) const;
  /// Returns whether a worker that has not failed the unit could get it, or renders it.
  bool has_hope(const WorkUnit& unit, Time now) const;
  /// Returns whether the unit has one result of two, and no worker gives the other in time.
  bool waits_for_nobody(const WorkUnit& unit, Time now) const;
  bool is_late(const WorkUnit& unit, Time now) const;

  const WorkOptions& options_;
  Log& log_;
  Units units_;
  std::map<std::string, Worker> workers_;
  std::set<std::string> suspended_;  ///< Also those that are silent.
  std::set<std::string> to_report_;
  Counts counts_;
  std::mt19937_64 chance_;
};

}  // namespace server
