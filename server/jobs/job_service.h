/// JobService: jobs from submission to deletion. What routes talk to.
///
/// Every change of a record is committed to the store before it is told, and told as events in the
/// order of the commits. Rendering happens on the scheduler's threads, loading and saving on
/// others; no call here waits for a renderer, except cancel() for some milliseconds.
#pragma once

#include <atomic>
#include <chrono>
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
#include "server/jobs/background.h"
#include "server/jobs/job.h"
#include "server/jobs/job_book.h"
#include "server/jobs/pilot.h"
#include "server/jobs/scheduler.h"
#include "server/observe/log.h"
#include "server/observe/memory_gate.h"
#include "server/observe/metrics.h"
#include "server/scenes/scene_service.h"
#include "server/scenes/single_flight_cache.h"
#include "server/store/data_dir.h"
#include "server/store/job_table.h"
#include "server/store/storage_quota.h"

namespace server {

struct JobServiceOptions {
  int threads = 1;
  BookLimits book = {};
  int samples_max = 65536;
  double checkpoint_seconds = 10;  ///< A checkpoint is complete this long after the one before.
  std::uint64_t film_cache_bytes = std::uint64_t{512} << 20U;
  JobTable::Retention retention = {};  ///< Of jobs that have ended.
  int quota_jobs = 0;                  ///< Unfinished jobs of one tenant; 0: any number.
  std::string arithmetic = {};         ///< core::arithmetic_class() of this process.
  std::string build = {};              ///< JSON text that goes with films made here.
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

class JobService final : private RenderRun::Owner {
 public:
  /// run: number of this run of the server.
  JobService(JobServiceParts parts, JobServiceOptions options, std::int64_t run);
  ~JobService() override;
  JobService(const JobService&) = delete;
  JobService& operator=(const JobService&) = delete;

  /// Takes up what the last process left unfinished. Once, before anything else.
  core::Status resume();
  /// No new jobs, nothing rendered any more, every film on the disk as far as it is.
  void stop();

  /// Draining: no new jobs are taken and none of the queue begins, until it is ended. What has
  /// begun goes on. A restart ends it.
  void set_draining(bool is_draining);
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

  /// What a job would cost, from a pilot among the other jobs' slices; waits for it, some seconds
  /// at most. Errors: those of loading the scene; kUnavailable when the pilot got no turn.
  core::Result<CostEstimate> estimate(const api::JobSpec& spec);

  /// Errors: kNotFound, also for a job that `access` does not see.
  core::Result<JobPointer> find(const std::string& id, const Access& access);
  api::JobView view(const Job& job) const;

  struct Page {
    std::vector<api::JobView> jobs;
    std::optional<std::int64_t> next;  ///< Sequence that the next page is before.
  };
  /// Of what `access` sees.
  core::Result<Page> list(JobQuery query, const Access& access);

  /// body: JSON merge patch. if_versions: those that spec_version may have. Problems: 409, 412,
  /// 422.
  api::Parsed<std::monostate> patch(const JobPointer& job, std::string_view body,
                                    const std::optional<std::vector<std::uint32_t>>& if_versions,
                                    const Access& access);
  /// Errors: kNoSpace when the store cannot take it; the job is as it was then.
  core::Status cancel(const JobPointer& job);
  /// Problems: 409 not finished or film gone; 422; 429 queue full, or the tenant's quota.
  api::Parsed<std::monostate> extend(const JobPointer& job, std::string_view body);
  /// A failed job goes on from its last checkpoint, or from the start where there is none.
  /// Problems: 409 not failed, or its inputs are gone; 429 as extend(); 507.
  api::Parsed<std::monostate> retry(const JobPointer& job);
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
  /// Errors: kConflict while it is not final.
  core::Status remove(const JobPointer& job);

  /// Is there a job that renders, may yet, or could be extended, and needs it? tenant: among the
  /// jobs of that one; empty: among all.
  core::Result<bool> needs_scene(const std::string& scene,
                                 const std::optional<std::string>& tenant);
  core::Result<bool> needs_asset(const std::string& asset,
                                 const std::optional<std::string>& tenant);

  /// The film as it is: being rendered, or stored. Errors: kConflict no sample yet; kGone evicted.
  core::Result<std::shared_ptr<const core::Film>> film(const Job& job);
  /// The film of a job that has ended: nobody changes it any more. Waits while it is being settled.
  /// Errors: of film(); kConflict while the job is not final; kUnavailable.
  core::Result<std::shared_ptr<const core::Film>> final_film(const Job& job,
                                                             const std::stop_token& stop);
  /// Empty before the first look.
  std::vector<core::ConvergencePoint> points(const Job& job);

  /// Durable events after a mark of any run, up to seq of this run's stream.
  core::Result<std::vector<EventRow>> stored_events(const Job& job, std::int64_t stream,
                                                    std::uint64_t seq);
  std::int64_t run_number() const { return run_; }

  struct Counts {
    std::map<std::string, std::int64_t> by_state;
    int queued = 0;
    int rendering = 0;
    double cpu_seconds = 0;
    std::uint64_t rays = 0;     ///< Since this process began.
    std::uint64_t samples = 0;  ///< The same, over all pixels.
    std::uint64_t film_cache_bytes = 0;
    std::uint64_t held_bytes = 0;  ///< By jobs from their start to their end.
    bool waits_for_memory = false;
  };
  Counts counts() const;
  /// Those that the server has paused until the disk has room.
  int jobs_without_room() const;
  bool any_job() const;
  int threads() const { return scheduler_.threads(); }

 private:
  using Modify = std::function<core::Status(JobRecord&)>;
  /// What becomes of a change that the store does not take. Only what nobody was promised may go on
  /// in memory: after a restart it has not been.
  enum class Unstored : std::uint8_t { kRefused, kRefusedIfFull, kInMemory };
  struct ChangeOptions {
    Unstored unstored = Unstored::kRefused;
    /// Runs when the change is committed, before it is told; the job's change_mutex() is held.
    std::function<void(const JobRecord&)> before_telling = {};
  };
  /// Modifies, commits, tells. The events follow from the difference. Errors: of modify, of the
  /// store; kConflict for a change of state that may not be; kNotFound when the job was deleted.
  core::Status change(Job& job, const Modify& modify, const ChangeOptions& options);
  struct Told {
    api::EventType type = api::EventType::kState;
    std::string data;
  };
  std::vector<Told> events_between(const Job& job, const JobRecord& before,
                                   const JobRecord& after) const;
  std::uint64_t reserve_events(Job& job, const std::vector<Told>& told,
                               std::vector<EventRow>& rows) const;
  static void publish_events(Job& job, std::uint64_t first, std::vector<Told> told);
  static std::optional<api::Problem> refused_priority(int priority, const Access& access);
  static std::vector<DeliveryRow> deliveries_of(const JobRecord& record,
                                                const std::vector<Told>& told);

  /// Empty: new work is taken.
  std::optional<core::Error> refused_work() const;
  core::Result<JobPointer> insert(api::ParsedJob request, const Submission& submission);
  core::Result<JobPointer> find_any(const std::string& id);
  core::Result<JobPointer> find_replay(const Submission& submission);
  core::Result<JobPointer> find_own_id(const Submission& submission);
  /// The tenant's place among its unfinished jobs, held until the job counts; or why there is none.
  api::Parsed<std::unique_lock<core::Mutex>> take_quota(const std::string& tenant);
  /// Cancels the previews that had the key before `by`.
  void supersede(const std::string& preview_key, const Job& by, const Access& access);

  /// What is admitted, and what dry_run says: at most so much is taken, from loading on.
  JobMemory memory_of(const api::JobView& view);
  /// Empty: it fits into what a job may hold.
  std::optional<api::FieldError> too_large(const api::JobView& view);
  /// Gives the memory of a paused job back; it goes on from its film file.
  void park(const JobPointer& job);

  /// A job that has ended waits for another turn, as `modify` says. Problems: of extend().
  api::Parsed<std::monostate> queue_again(const JobPointer& job, const Modify& modify);
  /// What follows from a change of the state. The job's change_mutex() is held.
  void follow_state(const JobPointer& job, api::JobState before, const JobRecord& after);

  // A job's way: admit() -> load() -> start() -> on_end() -> finish(). Cancelled ones are told at
  // once, and settle_cancelled() keeps what they have.
  void admit();
  void load(const std::shared_ptr<JobBook::Place>& place);
  core::Result<std::shared_ptr<const core::Renderer>> make_renderer(
      const api::JobSpec& spec, SceneService::Admission admission);
  core::Result<std::shared_ptr<const core::Renderer>> make_admitted_renderer(
      const api::JobSpec& spec);
  core::Result<std::shared_ptr<RenderRun>> prepare(const std::shared_ptr<JobBook::Place>& place);
  /// Makes the file unless the job was deleted. Errors: those of FilmFile::open(); kCancelled.
  core::Result<FilmFile> make_film_file(Job& job);
  core::Result<FilmFile> open_film_file(const JobPointer& job, core::Film& film,
                                        core::TaskOptions& options);
  void start(const JobPointer& job, const std::shared_ptr<RenderRun>& run, int generation);
  void on_first_slice(const RenderRun& run) override;
  void on_end(std::shared_ptr<RenderRun> run) override;
  /// Stores the end of the run.
  void settle(const JobPointer& job, const std::shared_ptr<RenderRun>& run);
  void finish(const JobPointer& job, const std::shared_ptr<RenderRun>& run,
              core::StopReason reason);
  void settle_cancelled(const JobPointer& job, const std::shared_ptr<RenderRun>& run);
  /// run: null when there is none yet.
  void fail(const JobPointer& job, const std::shared_ptr<RenderRun>& run,
            const core::Error& failure);
  /// The disk is full: the job stands still until go_on_with_room(). ended: the run whose end could
  /// not be stored, if there is one. False: the job has ended otherwise, and whoever calls settles
  /// the run.
  bool pause_for_room(const JobPointer& job, const std::shared_ptr<RenderRun>& ended);
  /// Jobs that wait for room on the disk go on if there is some.
  void go_on_with_room();
  /// The job has ended: its run, if any, gets no slices any more and gives its place back.
  void release(const JobPointer& job);
  void keep_film_of(const JobPointer& job, const RenderRun& run);

  core::Status apply_patch(JobRecord& record, const Job& job, const api::JobPatch& patch) const;
  void follow_patch(const JobPointer& job, const JobRecord& before, const JobRecord& after);

  void checkpoint_loop(const std::stop_token& stop);
  void checkpoint(const JobPointer& job);
  void evict_films();
  bool evict_film(const JobRow& row);
  void forget_expired();
  void count_work(const RenderRun& run);
  void remove_loose_film(const std::string& id);
  /// The file of a job that ended before it had a sample.
  void remove_unused_film(Job& job);
  /// In the cache. Other than the id of a job, it is never given twice.
  static std::string film_key(const Job& job) { return std::to_string(job.sequence()) + "."; }
  void remove_loose_films();
  static core::Progress progress_of(const RenderRun& run);
  core::Result<std::shared_ptr<const StoredFilm>> stored_film(const Job& job);
  core::Result<StoredFilm> read_film(const Job& job, const JobRecord& record);
  /// Says in the log and in the job, once, that its film is lost; the answer for who asks for it.
  core::Error tell_damage(const Job& job, const core::Error& damage);
  static Rank rank_of(const api::JobSpec& spec);
  static bool matches(const api::JobView& view, const JobQuery& query);

  JobTable& table_;
  SceneService& scenes_;
  const DataDir& data_;
  Log& log_;
  Metrics& metrics_;
  StorageQuota& quota_;
  MemoryGate& memory_;
  const JobServiceOptions options_;
  const std::int64_t run_;
  std::atomic<std::uint64_t> rays_done_ = 0;  ///< Of runs that are over.
  std::atomic<std::uint64_t> samples_done_ = 0;
  std::counting_semaphore<16> pilots_;
  std::atomic<std::int64_t> last_sequence_ = 0;
  std::atomic<bool> stopping_ = false;
  std::atomic<bool> draining_ = false;
  JobBook book_;
  SingleFlightCache<StoredFilm> films_;
  core::Mutex keyed_mutex_;  ///< Held over a submission with a key: two of them are one job.
  core::Mutex
      quota_mutex_;  ///< Held from counting a tenant's jobs to adding one. After keyed_mutex_.
  /// When a job was last saved; of the checkpointer's thread alone.
  std::map<std::string, std::chrono::steady_clock::time_point> checkpointed_;
  Scheduler scheduler_;
  Background loaders_;
  Background preview_loaders_;
  Background savers_;
  std::jthread checkpointer_;
};

}  // namespace server
