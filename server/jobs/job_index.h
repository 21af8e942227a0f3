/// JobIndex: jobs that were made, in memory or in the store: one by its id, lists, and who needs
/// which scene.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "api/job_view.h"
#include "core/base/result.h"
#include "server/access.h"
#include "server/jobs/job.h"
#include "server/jobs/job_book.h"
#include "server/store/job_table.h"

namespace server {

class JobIndex {
 public:
  /// Both outlive it.
  JobIndex(JobTable& table, JobBook& book) : table_(table), book_(book) {}

  /// Errors: kNotFound, also for a job that `access` does not see.
  core::Result<JobPointer> find(const std::string& id, const Access& access);
  /// Among the jobs of all tenants.
  core::Result<JobPointer> find(const std::string& id);
  /// With the latest figures of its run.
  api::JobView view(const Job& job) const;

  struct Page {
    std::vector<api::JobView> jobs;
    std::optional<std::int64_t> next;  ///< Sequence that the next page is before.
  };
  /// Of what `access` sees.
  core::Result<Page> list(JobQuery query, const Access& access);

  /// Is there a job that renders, may yet, or could be extended, and needs it? tenant: among the
  /// jobs of that one; empty: among all.
  core::Result<bool> needs_scene(const std::string& scene,
                                 const std::optional<std::string>& tenant);
  core::Result<bool> needs_asset(const std::string& asset,
                                 const std::optional<std::string>& tenant);

 private:
  JobTable& table_;
  JobBook& book_;
};

}  // namespace server
