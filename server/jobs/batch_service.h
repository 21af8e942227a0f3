/// BatchService: jobs that were submitted together. The state of a batch follows from its jobs; the
/// store only records which jobs belong to it, and whether its end was reported.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "api/batch.h"
#include "core/base/mutex.h"
#include "core/base/result.h"
#include "server/access.h"
#include "server/jobs/job_service.h"
#include "server/jobs/verdict.h"
#include "server/observe/log.h"
#include "server/store/batch_table.h"

namespace server {

class BatchService {
 public:
  /// All arguments must outlive it. Starts reporting the ends of batches.
  BatchService(JobService& jobs, JobTable& keys, BatchTable& table, Log& log);
  /// Stops the job service first: ends of jobs are reported to this object.
  ~BatchService();
  BatchService(const BatchService&) = delete;
  BatchService& operator=(const BatchService&) = delete;

  /// Reports ends that the previous process did not report. Call after JobService::resume().
  void resume() { report_ends(std::nullopt); }

  struct Submitted {
    api::BatchView batch;
    bool is_replay = false;
  };
  /// Checks whether the batch would be accepted. Problems: as JobService::check(), with pointers
  /// into the request.
  std::optional<api::Problem> check(const api::BatchRequest& request, const Access& access);
  /// key: Idempotency-Key; empty: none. Problems: of check() and JobService::submit().
  api::Parsed<Submitted> submit(api::BatchRequest request, const Access& access,
                                const std::string& key, const std::string& body_hash);

  /// Errors: kNotFound, also for a batch that `access` does not see.
  core::Result<api::BatchView> view(std::string_view id, const Access& access);
  struct Page {
    std::vector<api::BatchView> batches;
    std::optional<std::int64_t> next;  ///< Sequence before which the next page starts.
  };
  core::Result<Page> list(std::optional<std::int64_t> before, int limit, const Access& access);
  core::Result<std::vector<JobPointer>> jobs(std::string_view id, const Access& access);

  Verdict cancel(std::string_view id, const Access& access);
  /// Retries the failed jobs. Refused: 409 where no job has failed.
  Verdict retry(std::string_view id, const Access& access);
  /// Deletes the batch and its jobs. Refused: 409 while a job runs; then none is deleted.
  Verdict remove(std::string_view id, const Access& access);

 private:
  /// Leaves out those whose records are damaged, which view_of() names.
  core::Result<std::vector<JobPointer>> jobs_of(const BatchRow& batch);
  core::Result<api::BatchView> view_of(const BatchRow& batch);
  core::Result<std::optional<BatchRow>> find_replay(const std::string& key,
                                                    const std::string& body_hash,
                                                    const Access& access);
  /// job: only the batch of that job; empty: all batches.
  void report_ends(const std::optional<std::string>& job);

  JobService& jobs_;
  JobTable& keys_;
  BatchTable& table_;
  Log& log_;
  ///< Held during a submission with a key, so that two requests with one key create one batch.
  core::Mutex keyed_mutex_;
};

}  // namespace server
