/// Journal: commits every change of a job's record to the store before publishing it, and publishes
/// events in the order of the commits.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/jobs/job.h"
#include "server/jobs/job_book.h"
#include "server/jobs/verdict.h"
#include "server/observe/log.h"
#include "server/observe/metrics.h"
#include "server/store/job_table.h"

namespace server {

class Journal {
 public:
  /// book: gives waiting jobs' positions for their events. run: number of this run of the server.
  /// All arguments must outlive it.
  Journal(JobTable& table, const JobBook& book, Log& log, Metrics& metrics, std::int64_t run);

  /// Changes the record or refuses to.
  using Modify = std::function<Verdict(JobRecord&)>;
  /// Handling of a change that the store cannot record. kInMemory only for changes that were not
  /// acknowledged to a client: a restart undoes them.
  enum class Unstored : std::uint8_t { kRefused, kRefusedIfFull, kInMemory };
  struct Options {
    Unstored unstored = Unstored::kRefused;
    /// Called after the commit and before publishing, with the job's change_mutex() held.
    std::function<void(const JobRecord&)> before_publishing = {};
  };
  /// Modifies, commits, publishes; the events follow from the difference. Refused: by modify, by
  /// the store; kConflict for an invalid transition of the state; kNotFound when the job was
  /// deleted.
  Verdict change(Job& job, const Modify& modify, const Options& options);
  /// Commits new records of several jobs in one transaction, and publishes them even if the store
  /// fails: the jobs are not visible yet.
  void change_together(std::vector<std::pair<JobPointer, JobRecord>> changes);

  /// Data stored together with the first record of a job.
  struct Beside {
    std::uint64_t reserved_bytes = 0;  ///< as in JobRow
    std::optional<IdempotencyRow> key = {};
  };
  /// Commits and publishes the initial record of a job. Errors: of the store.
  core::Status enter(Job& job, const Beside& beside);

  /// The same for the jobs of a batch: all or none. reserved_bytes: of each job.
  core::Status enter_together(const std::vector<JobPointer>& jobs,
                              const std::vector<std::uint64_t>& reserved_bytes,
                              const std::optional<IdempotencyRow>& key,
                              const JobTable::Beside& beside);

  /// Adds a listener to committed changes of jobs' states, called with the job's change_mutex()
  /// held and the new state. Pre: no job runs; the same for forget_listeners().
  void on_state(std::function<void(const Job&, api::JobState)> listener) {
    on_state_.push_back(std::move(listener));
  }
  void forget_listeners() { on_state_.clear(); }

  /// Returns durable events after a mark of any run, up to seq of this run's stream.
  core::Result<std::vector<EventRow>> events_after(const Job& job, std::int64_t stream,
                                                   std::uint64_t seq);
  std::int64_t run_number() const { return run_; }

 private:
  struct News {
    api::EventType type = api::EventType::kState;
    std::string data;
  };
  std::vector<News> news_between(const Job& job, const JobRecord& before,
                                 const JobRecord& after) const;
  /// Reserves numbers for the events; returns the first.
  std::uint64_t reserve(Job& job, const std::vector<News>& news, std::vector<EventRow>& rows) const;
  static void publish(Job& job, std::uint64_t first, std::vector<News> news);
  static std::vector<DeliveryRow> deliveries_of(const JobRecord& record,
                                                const std::vector<News>& news);
  void note_end(Job& job, std::uint64_t first, const std::vector<News>& news) const;

  JobTable& table_;
  const JobBook& book_;
  Log& log_;
  Metrics& metrics_;
  const std::int64_t run_;
  std::vector<std::function<void(const Job&, api::JobState)>> on_state_ = {};
};

}  // namespace server
