/// Jobs that URLs of images have started and that have not ended: only so many at a time.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "core/base/mutex.h"
#include "server/jobs/job_service.h"

namespace server {

/// Counts jobs of this process: those that an earlier one left are not counted.
class UrlJobs {
 public:
  struct Bounds {
    int of_preset;
    int of_tenant;
  };
  explicit UrlJobs(Bounds bounds) : bounds_(bounds) {}

  using Submit = std::function<api::Parsed<JobService::Submitted>()>;
  /// Submits a job, counted if it is new. has_job: submit() will return one that is there.
  /// Problems: 503 for a new job where there is no room; those of submit().
  api::Parsed<JobService::Submitted> enter(const std::string& tenant, const std::string& preset,
                                           bool has_job, const Submit& submit);

 private:
  using ByPreset = std::map<std::string, std::vector<JobPointer>>;

  const Bounds bounds_;
  core::Mutex mutex_;  ///< Held while a job is submitted, so that the bounds are exact.
  std::map<std::string, ByPreset> unfinished_ GUARDED_BY(mutex_);  ///< By tenant.
};

}  // namespace server
