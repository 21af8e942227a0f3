/// JobIndex: finds jobs by id in memory and in the store, lists them, and returns the scenes that
/// they need.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "api/answers/job_view.h"
#include "core/base/result.h"
#include "server/access.h"
#include "server/jobs/job.h"
#include "server/jobs/job_book.h"
#include "server/store/job_table.h"

namespace server {

class JobIndex {
 public:
  /// Both arguments must outlive it.
  JobIndex(JobTable& table, JobBook& book) : table_(table), book_(book) {}

  /// Errors: kNotFound, also for a job that `access` does not see.
  core::Result<JobPointer> find(const std::string& id, const Access& access);
  /// Finds a job of any tenant.
  core::Result<JobPointer> find(const std::string& id);
  /// Returns the job with the latest figures of its run.
  api::JobView view(const Job& job) const;

  struct Page {
    std::vector<api::JobView> jobs;
    std::vector<std::string> damaged;  ///< Ids of jobs of the page whose records cannot be read.
    std::optional<std::int64_t> next;  ///< Sequence before which the next page starts.
  };
  /// Lists the jobs that `access` sees.
  core::Result<Page> list(JobQuery query, const Access& access);

  /// Returns whether an unfinished or extendable job needs the scene. tenant: only jobs of that
  /// tenant; empty: all.
  core::Result<bool> needs_scene(const std::string& scene,
                                 const std::optional<std::string>& tenant);
  core::Result<bool> needs_asset(const std::string& asset,
                                 const std::optional<std::string>& tenant);

 private:
  JobTable& table_;
  JobBook& book_;
};

}  // namespace server
