/// JobService: jobs from submission to deletion. What routes talk to.
///
/// Its parts, each with its own header: Journal (changes, commits, publishes), JobIndex (finds and
/// lists), FilmLibrary (cache, readers, eviction), RunBuilder (what a job needs), LifeCycle (queue
/// to end). What clients ask for, and whether they may, is decided here.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <semaphore>
#include <string>
#include <thread>
#include <vector>

#include "api/requests.h"
#include "api/server_view.h"
#include "core/base/mutex.h"
#include "core/base/result.h"
#include "server/access.h"
#include "server/jobs/film_library.h"
#include "server/jobs/job_index.h"
#include "server/jobs/journal.h"
#include "server/jobs/life_cycle.h"
#include "server/jobs/pilot.h"
#include "server/jobs/run_builder.h"
#include "server/jobs/verdict.h"
#include "server/jobs/work_board.h"
#include "server/store/storage_quota.h"

namespace server {

/// How long an idempotency key is known.
inline constexpr double kKeySeconds = 24 * 3600;

/// Refused: the key may not give so high a priority.
Verdict priority_allowed(int priority, const Access& access);

struct JobServiceOptions {
  int threads = 1;
  BookLimits book = {};
  int samples_max = 65536;
  double checkpoint_seconds = 10;  ///< A checkpoint is complete this long after the one before.
  std::uint64_t film_cache_bytes = std::uint64_t{512} << 20U;
  JobTable::Retention retention = {};           ///< Of jobs that have ended.
  int quota_jobs = 0;                           ///< Unfinished jobs of one tenant; 0: any number.
  std::string arithmetic = {};                  ///< core::arithmetic_class() of this process.
  std::string build = {};                       ///< JSON text that goes with films made here.
  std::shared_ptr<queue::NatsLink> queue = {};  ///< That workers take units from; null: none do.
  int render_threads = 0;                       ///< With a queue: as LocalThreads::max.
  WorkOptions work = {};
};

/// What the service is built on; all outlive it.
struct JobServiceParts {
  JobTable& table;
  SceneService& scenes;
  const DataDir& data;
  Log& log;
  Metrics& metrics;
  StorageQuota& quota;
  MemoryGate& memory;
};

class JobService {
 public:
  /// run: number of this run of the server.
  JobService(JobServiceParts parts, JobServiceOptions options, std::int64_t run);
  ~JobService();
  JobService(const JobService&) = delete;
  JobService& operator=(const JobService&) = delete;

  /// Takes up what the last process left unfinished. Once, before anything else.
  core::Status resume();
  /// No new jobs, nothing rendered any more, every film on the disk as far as it is.
  void stop();
  /// For jobs with stop.denoised_error; before resume().
  void set_denoised_bound(RunBuilder::DenoisedBound bound) {
    builder_.set_denoised_bound(std::move(bound));
  }

  /// Draining: no new jobs are taken and none of the queue begins, until it is ended. What has
  /// begun goes on. A restart ends it.
  void set_draining(bool is_draining) { life_.set_draining(is_draining); }
  api::DrainView drain() const;

  /// Against the scene and the assets that `access` sees: what dry_run asks, and submit() does
  /// first. Settles what depends on the scene. Problems: 404 scene, 422.
  api::Parsed<api::ParsedJob> check(api::ParsedJob request, const Access& access);

  /// Where a submission comes from.
  struct Submission {
    Access access = {};    ///< Who submits; the job is of its tenant.
    std::string key = {};  ///< Idempotency-Key; each tenant has its own; empty: none.
    std::string body_hash = {};
    std::string id = {};  ///< The client's own UUID; empty: one is made.
  };
  struct Submitted {
    JobPointer job;
    bool is_replay = false;
  };
  /// Problems: of check(); 404 an id that another tenant has taken; 409 key or id with another
  /// body; 429 queue or quota full; 503 stopping; 507 disk full, or at /film more than the tenant
  /// may keep.
  api::Parsed<Submitted> submit(api::ParsedJob request, const Submission& submission);

  /// Jobs of a batch: all of them or none.
  struct Together {
    Access access = {};
    std::optional<IdempotencyRow> key = {};
    /// Writes the batch, knowing the jobs' sequences, in the transaction that makes the jobs.
    std::function<core::Status(Database::Session&, const std::vector<std::int64_t>&)> beside;
  };
  /// Problems: as submit().
  api::Parsed<std::vector<JobPointer>> submit_together(std::vector<api::ParsedJob> requests,
                                                       const Together& together);

  /// What a job would cost, from a pilot among the other jobs' slices; waits for it, some seconds
  /// at most. Errors: those of loading the scene; kUnavailable when the pilot got no turn.
  core::Result<CostEstimate> estimate(const api::JobSpec& spec);

  /// body: JSON merge patch. if_versions: those that spec_version may have. Refused: 409, 412, 422.
  Verdict patch(const JobPointer& job, std::string_view body,
                const std::optional<std::vector<std::uint32_t>>& if_versions, const Access& access);
  /// Refused: 507 when the store cannot take it; the job is as it was then.
  Verdict cancel(const JobPointer& job) { return life_.cancel(job); }
  /// Refused: 409 not finished or film gone; 422; 429 queue full, or the tenant's quota.
  Verdict extend(const JobPointer& job, std::string_view body);
  /// A failed job goes on from its last checkpoint, or from the start where there is none. Refused:
  /// 409 not failed, or its inputs are gone; 429 as extend(); 507.
  Verdict retry(const JobPointer& job);
  /// Refused: 409 while it is not final.
  Verdict remove(const JobPointer& job);

  /// A film from elsewhere becomes a finished job. spec: of the film's geometry; ledger as JobView
  /// has it.
  struct FinishedFilm {
    api::JobSpec spec;
    std::shared_ptr<const core::Film> film;
    core::SampleLedger ledger;
    core::StopReason stop_reason = core::StopReason::kSamples;
    double elapsed_seconds = 0;
    std::string build;       ///< JSON text
    std::string arithmetic;  ///< core::arithmetic_class() of the films; empty: unknown
    std::vector<std::string> warnings;
    std::string tenant;
  };
  /// Errors: kUnavailable when stopping, kOverQuota, kNoSpace, kInternal.
  core::Result<JobPointer> add_finished(FinishedFilm finished);

  JobIndex& index() { return index_; }
  const JobIndex& index() const { return index_; }
  FilmLibrary& films() { return films_; }
  Journal& journal() { return journal_; }

  core::Result<JobPointer> find(const std::string& id, const Access& access) {
    return index_.find(id, access);
  }
  api::JobView view(const Job& job) const { return index_.view(job); }

  /// The view that the job is rendered from, loaded again where it has ended. Errors: those of
  /// loading the scene.
  core::Result<core::View> scene_view(const Job& job) const;

  struct Counts {
    std::map<std::string, std::int64_t> by_state;
    int queued = 0;
    int rendering = 0;
    Scheduler::Times threads;
    std::uint64_t rays = 0;     ///< Since this process began.
    std::uint64_t samples = 0;  ///< The same, over all pixels.
    std::uint64_t film_cache_bytes = 0;
    std::uint64_t held_bytes = 0;  ///< By jobs from their start to their end.
    bool waits_for_memory = false;
  };
  Counts counts() const;
  /// Those that the server has paused until the disk has room.
  int jobs_without_room() const;
  bool any_job() const { return last_sequence_ > 0; }
  int threads() const { return scheduler_.threads(); }
  /// Null: there is no queue.
  WorkBoard* board() { return board_.get(); }

 private:
  /// Empty: new work is taken.
  std::optional<core::Error> refused_work() const;
  core::Result<JobPointer> insert(api::ParsedJob request, const Submission& submission);
  core::Result<JobPointer> find_replay(const Submission& submission);
  core::Result<JobPointer> find_own_id(const Submission& submission);
  /// The tenant's place among its unfinished jobs, held until the job counts; or why there is none.
  api::Parsed<std::unique_lock<core::Mutex>> take_quota(const std::string& tenant, int jobs = 1);
  core::Result<std::vector<JobPointer>> insert_together(std::vector<api::ParsedJob> requests,
                                                        const Together& together);
  /// Cancels the previews that had the key before `by`.
  void supersede(const std::string& preview_key, const Job& by, const Access& access);
  Verdict apply_patch(JobRecord& record, const Job& job, const api::JobPatch& patch) const;
  /// A job that has ended waits for another turn, as `modify` says. Refused: as extend().
  Verdict queue_again(const JobPointer& job, const Journal::Modify& modify);

  void upkeep(const std::stop_token& stop);
  void forget_expired();

  JobTable& table_;
  SceneService& scenes_;
  const DataDir& data_;
  Log& log_;
  StorageQuota& quota_;
  MemoryGate& memory_;
  const JobServiceOptions options_;
  std::counting_semaphore<16> pilots_;
  std::atomic<std::int64_t> last_sequence_ = 0;
  core::Mutex keyed_mutex_;  ///< Held over a submission with a key: two of them are one job.
  core::Mutex
      quota_mutex_;  ///< Held from counting a tenant's jobs to adding one. After keyed_mutex_.
  JobBook book_;
  Journal journal_;
  JobIndex index_;
  FilmLibrary films_;
  RunBuilder builder_;
  LocalThreads local_;
  Scheduler scheduler_;
  LifeCycle life_;
  std::unique_ptr<WorkBoard> board_;
  std::jthread upkeep_;
};

}  // namespace server
