/// Submissions: new jobs, from the request to the queue: ids and keys by which a request finds the
/// job that it made before, quotas, and imported films that become finished jobs.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "api/requests.h"
#include "core/base/mutex.h"
#include "core/base/result.h"
#include "server/access.h"
#include "server/jobs/film_library.h"
#include "server/jobs/job_index.h"
#include "server/jobs/journal.h"
#include "server/jobs/life_cycle.h"
#include "server/jobs/run_builder.h"
#include "server/observe/clock.h"
#include "server/store/storage_quota.h"

namespace server {

/// Lifetime of an idempotency key.
inline constexpr double kKeySeconds = kDaySeconds;

/// Refused if the key does not allow this priority. pointer: of its member.
Verdict priority_allowed(int priority, const Access& access, std::string pointer = "/priority");

struct SubmissionOptions {
  double retention_seconds = 0;  ///< of jobs that have ended; 0: any time
  int quota_jobs = 0;            ///< Unfinished jobs of one tenant; 0: any number.
};

class Submissions {
 public:
  /// All members must outlive it.
  struct Parts {
    JobTable& table;
    SceneService& scenes;
    Log& log;
    StorageQuota& quota;
    JobBook& book;
    Journal& journal;
    JobIndex& index;
    FilmLibrary& films;
    RunBuilder& builder;
    LifeCycle& life;
  };
  Submissions(Parts parts, SubmissionOptions options) : parts_(parts), options_(options) {}

  /// last_sequence: that of the newest stored job. Call once, before any job is added.
  void resume(std::int64_t last_sequence) { last_sequence_ = last_sequence; }
  bool any() const { return last_sequence_ > 0; }

  struct Checked {
    api::ParsedJob job;
    Admission admission;
  };
  /// Checks the request against the scene and the assets that `access` sees, as dry_run and
  /// submit() do, and resolves settings that depend on the scene. Problems: 404 scene, 422.
  api::Parsed<Checked> check(api::ParsedJob request, const Access& access);

  /// Origin of a submission.
  struct Submission {
    Access access = {};    ///< The submitter; the job belongs to its tenant.
    std::string key = {};  ///< Idempotency-Key, separate for each tenant; empty: none.
    std::string body_hash = {};
    std::string id = {};  ///< The client's own UUID; empty: a new one.
    /// The key is the hash of the whole request, not the client's: a job of the same request is
    /// returned while it is active or has its film, and made again otherwise.
    bool is_by_content = false;
    /// Then also a job that has failed less than this long ago, so that a request that always fails
    /// does not make a job each time.
    double failed_seconds = 0;
  };
  struct Submitted {
    JobPointer job;
    bool is_replay = false;
  };
  /// Problems: of check(); 404 an id of another tenant; 409 key or id with another body; 429 queue
  /// or quota full; 503 stopping; 507 disk full, or at /film more than the tenant's quota.
  api::Parsed<Submitted> submit(api::ParsedJob request, const Submission& submission);
  /// Returns the job that submit() would return in place of a new one; null: none.
  core::Result<JobPointer> find_equal(const Submission& submission);

  /// Jobs of a batch: all are stored or none.
  struct Together {
    Access access = {};
    std::optional<IdempotencyRow> key = {};
    /// Writes the batch, given the jobs' sequences, in the transaction that inserts the jobs.
    std::function<core::Status(Database::Session&, const std::vector<std::int64_t>&)> beside;
  };
  /// Problems: of submit().
  api::Parsed<std::vector<JobPointer>> submit_together(std::vector<api::ParsedJob> requests,
                                                       const Together& together);

  /// An imported film that becomes a finished job. spec: with the film's geometry; ledger: as in
  /// JobView.
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
    std::set<std::string> unverified = {};  ///< As in JobRecord, of all its parts.
    bool is_doubted = false;
  };
  /// Errors: kUnavailable when stopping, kOverQuota, kNoSpace, kInternal.
  core::Result<JobPointer> add_finished(FinishedFilm finished);

  /// Returns the reason why new work is refused; empty if it is accepted.
  std::optional<core::Error> refused_work() const;
  /// Locks the count of the tenant's unfinished jobs until the new jobs are added, or returns why
  /// the quota does not allow them.
  api::Parsed<std::unique_lock<core::Mutex>> take_quota(const std::string& tenant, int jobs = 1);

 private:
  core::Result<JobPointer> insert(api::ParsedJob request, const Submission& submission,
                                  std::uint64_t film_file_bytes);
  core::Result<JobPointer> find_replay(const Submission& submission);
  core::Result<JobPointer> find_own_id(const Submission& submission);
  core::Result<std::vector<JobPointer>> insert_together(std::vector<Checked>& requests,
                                                        const Together& together);
  /// Cancels earlier previews with the same key as `by`.
  void supersede(const std::string& preview_key, const Job& by, const Access& access);

  const Parts parts_;
  const SubmissionOptions options_;
  std::atomic<std::int64_t> last_sequence_ = 0;
  /// Held during a submission with a key, so that two requests with one key create one job.
  core::Mutex keyed_mutex_;
  /// Held from counting a tenant's jobs to adding one. After keyed_mutex_.
  core::Mutex quota_mutex_;
};

}  // namespace server
