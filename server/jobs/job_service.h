/// JobService: jobs from submission to deletion, as the routes use them.
///
/// Its parts, each with its own header: JobBook (known, waiting and running jobs, and their
/// memory), Journal (changes, commits, publishes), JobIndex (finds and lists), FilmLibrary (cache,
/// readers, eviction), RunBuilder (inputs of a job), Scheduler (render threads), Submissions
/// (checks new jobs and stores them), LifeCycle (queue to end), WorkBoard (units for other
/// machines). This class decides what clients may change.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "api/answers/server_view.h"
#include "api/requests.h"
#include "core/base/mutex.h"
#include "core/base/result.h"
#include "server/access.h"
#include "server/jobs/film_library.h"
#include "server/jobs/job_index.h"
#include "server/jobs/journal.h"
#include "server/jobs/life_cycle.h"
#include "server/jobs/pilot.h"
#include "server/jobs/run_builder.h"
#include "server/jobs/submissions.h"
#include "server/jobs/verdict.h"
#include "server/store/storage_quota.h"
#include "server/store/worker_table.h"
#include "server/workers/work_options.h"

namespace queue {
class UnitQueue;
}

namespace server {

class WorkBoard;

struct JobServiceOptions {
  int threads = 1;
  BookLimits book = {};
  int samples_max = 65536;
  double checkpoint_seconds = 10;  ///< From the end of one checkpoint to the end of the next.
  std::uint64_t film_cache_bytes = std::uint64_t{512} << 20U;
  JobTable::Retention retention = {};  ///< For finished jobs.
  int quota_jobs = 0;                  ///< Unfinished jobs of one tenant; 0: any number.
  std::string arithmetic = {};         ///< core::arithmetic_class() of this process.
  std::string build = {};              ///< JSON text stored with films rendered here.
  ///< From which workers take units; null: no workers.
  std::shared_ptr<queue::UnitQueue> queue = {};
  int render_threads = 0;  ///< With a queue: LocalThreads::max.
  WorkOptions work = {};
};

/// Dependencies of the service; all must outlive it.
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

  /// Resumes the jobs that the previous process left unfinished. Call once, before all other
  /// members.
  core::Status resume();
  /// Refuses new jobs, stops rendering and saves every film.
  void stop();
  /// For jobs with stop.denoised_error. Call before resume().
  void set_denoised_bound(RunBuilder::DenoisedBound bound) {
    builder_.set_denoised_bound(std::move(bound));
  }

  /// While draining, new jobs are refused and queued ones do not start; started ones continue. A
  /// restart ends draining.
  void set_draining(bool is_draining) { life_.set_draining(is_draining); }
  api::DrainView drain() const;

  using Checked = Submissions::Checked;
  using Submission = Submissions::Submission;
  using Submitted = Submissions::Submitted;
  using Together = Submissions::Together;
  using FinishedFilm = Submissions::FinishedFilm;
  // As the functions of Submissions.
  api::Parsed<Checked> check(api::ParsedJob request, const Access& access) {
    return submissions_.check(std::move(request), access);
  }
  api::Parsed<Submitted> submit(api::ParsedJob request, const Submission& submission) {
    return submissions_.submit(std::move(request), submission);
  }
  core::Result<JobPointer> find_equal(const Submission& submission) {
    return submissions_.find_equal(submission);
  }
  api::Parsed<std::vector<JobPointer>> submit_together(std::vector<api::ParsedJob> requests,
                                                       const Together& together) {
    return submissions_.submit_together(std::move(requests), together);
  }
  core::Result<JobPointer> add_finished(FinishedFilm finished);

  /// Estimates the cost of a job from a pilot rendered between other jobs' slices; waits at most
  /// some seconds. Errors: of loading the scene; kUnavailable when the pilot got no slice;
  /// kCancelled when a stop was requested.
  core::Result<api::CostView> estimate(const api::JobSpec& spec, const std::string& tenant,
                                       const std::stop_token& stop);

  /// body: JSON merge patch. if_versions: accepted values of spec_version. Refused: 409, 412, 422.
  Verdict patch(const JobPointer& job, std::string_view body,
                const std::optional<std::vector<std::uint32_t>>& if_versions, const Access& access);
  /// Refused: 507 when the store cannot record it; the job is then unchanged.
  Verdict cancel(const JobPointer& job) { return life_.cancel(job); }
  /// Refused: 409 not finished or film gone; 422; 429 queue or quota full.
  Verdict extend(const JobPointer& job, std::string_view body);
  /// Resumes a failed job from its last checkpoint, or from the start if there is none. Refused:
  /// 409 not failed, or its inputs are gone; 429 as extend(); 507.
  Verdict retry(const JobPointer& job);
  /// Refused: 409 while it is not final.
  Verdict remove(const JobPointer& job);
  /// Also removes a job whose record is damaged, so that it cannot be found. Refused: also 404.
  Verdict remove(const std::string& id, const Access& access);

  // For WorkBoard.
  /// Records that the job's film gets unverified samples of the worker.
  void note_unverified(Job& job, const std::string& worker);
  /// The worker returned wrong results, which is stored: as LifeCycle::distrust() for all jobs, in
  /// memory or stored, and for films that are merged later. Repeated until it is stored.
  void distrust(const std::string& worker);

  JobIndex& index() { return index_; }
  const JobIndex& index() const { return index_; }
  FilmLibrary& films() { return films_; }
  Journal& journal() { return journal_; }

  core::Result<JobPointer> find(const std::string& id, const Access& access) {
    return index_.find(id, access);
  }
  api::JobView view(const Job& job) const { return index_.view(job); }

  /// Returns the view that the job is rendered from, loading it again if the job has ended. Errors:
  /// of loading the scene.
  core::Result<core::View> scene_view(const Job& job) const;
  /// Returns the job's scene at another time, from the origin of that view. Errors: of loading.
  core::Result<std::shared_ptr<const core::MotionTarget>> scene_at(const Job& job,
                                                                   double time_seconds,
                                                                   core::Place origin) const;

  struct Counts {
    std::map<std::string, std::int64_t> by_state;
    int queued = 0;
    int rendering = 0;
    Scheduler::Times threads;
    std::uint64_t rays = 0;     ///< Since this process began.
    std::uint64_t samples = 0;  ///< The same, over all pixels.
    std::uint64_t film_cache_bytes = 0;
    std::uint64_t held_bytes = 0;  ///< Held by jobs from start to end.
    bool waits_for_memory = false;
  };
  Counts counts() const;
  /// Returns the number of jobs that the server paused until the disk has space.
  int jobs_without_room() const;
  bool any_job() const { return submissions_.any(); }
  int threads() const { return scheduler_.threads(); }
  /// Null without a queue.
  WorkBoard* board() { return board_.get(); }

 private:
  /// Removes the record, its events and its film.
  core::Status remove_record(const std::string& id);
  /// Returns errors for new rules of a job that have no meaning with its scene.
  Verdict check_stop(const core::StopRules& stop, const std::string& scene) const;
  Verdict apply_patch(JobRecord& record, const Job& job, const api::JobPatch& patch) const;
  /// Queues a finished job again, modified by `modify`. Refused: as extend().
  Verdict queue_again(const JobPointer& job, const Journal::Modify& modify);

  void upkeep(const std::stop_token& stop);
  void forget_expired();
  /// Errors: of the store.
  core::Status doubt_jobs_of(const std::string& worker);
  /// Does it for the next worker of distrusted_.
  void distrust_again();

  JobTable& table_;
  WorkerTable workers_;
  SceneService& scenes_;
  const DataDir& data_;
  Log& log_;
  StorageQuota& quota_;
  MemoryGate& memory_;
  const JobServiceOptions options_;
  Turns pilots_;
  JobBook book_;
  Journal journal_;
  JobIndex index_;
  FilmLibrary films_;
  RunBuilder builder_;
  LocalThreads local_;
  Scheduler scheduler_;
  LifeCycle life_;
  Submissions submissions_;
  core::Mutex distrusted_mutex_;
  /// Workers whose suspension or whose jobs' doubts may not be stored.
  std::deque<std::string> distrusted_ GUARDED_BY(distrusted_mutex_);
  std::unique_ptr<WorkBoard> board_;
  std::jthread upkeep_;
};

}  // namespace server
