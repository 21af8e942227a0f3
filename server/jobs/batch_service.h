/// BatchService: jobs that were made together. Their state is their jobs'; the store knows only
/// which they are, and whether their end was reported.
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
  /// All outlive it. From now on the ends of batches are reported.
  BatchService(JobService& jobs, JobTable& keys, BatchTable& table, Log& log);
  /// Stops the jobs: their ends would be reported here.
  ~BatchService();
  BatchService(const BatchService&) = delete;
  BatchService& operator=(const BatchService&) = delete;

  /// Reports the ends that the last process did not. After JobService::resume().
  void resume() { report_ends(std::nullopt); }

  struct Submitted {
    api::BatchView batch;
    bool is_replay = false;
  };
  /// Would it be taken? Problems: as JobService::check(), with pointers into the request.
  std::optional<api::Problem> check(const api::BatchRequest& request, const Access& access);
  /// key: Idempotency-Key; empty: none. Problems: of check() and JobService::submit().
  api::Parsed<Submitted> submit(api::BatchRequest request, const Access& access,
                                const std::string& key, const std::string& body_hash);

  /// Errors: kNotFound, also for what `access` does not see.
  core::Result<api::BatchView> view(std::string_view id, const Access& access);
  struct Page {
    std::vector<api::BatchView> batches;
    std::optional<std::int64_t> next;  ///< Sequence that the next page is before.
  };
  core::Result<Page> list(std::optional<std::int64_t> before, int limit, const Access& access);
  core::Result<std::vector<JobPointer>> jobs(std::string_view id, const Access& access);

  Verdict cancel(std::string_view id, const Access& access);
  /// Refused: 409 where no job has failed.
  Verdict retry(std::string_view id, const Access& access);
  /// Refused: 409 while a job runs; then none is deleted.
  Verdict remove(std::string_view id, const Access& access);

 private:
  core::Result<std::vector<JobPointer>> jobs_of(const BatchRow& batch);
  core::Result<api::BatchView> view_of(const BatchRow& batch);
  core::Result<std::optional<BatchRow>> find_replay(const std::string& key,
                                                    const std::string& body_hash,
                                                    const Access& access);
  /// job: of the batch of that job; empty: of all batches.
  void report_ends(const std::optional<std::string>& job);

  JobService& jobs_;
  JobTable& keys_;
  BatchTable& table_;
  Log& log_;
  core::Mutex keyed_mutex_;  ///< Held over a submission with a key: two of them are one batch.
};

}  // namespace server
