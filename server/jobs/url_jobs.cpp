#include "server/jobs/url_jobs.h"

#include "api/answers/job_view.h"
#include "api/json/errors.h"

namespace server {

api::Parsed<JobService::Submitted> UrlJobs::enter(const std::string& tenant,
                                                  const std::string& preset, bool has_job,
                                                  const Submit& submit) {
  const core::MutexLock lock(mutex_);
  ByPreset& of_tenant = unfinished_[tenant];
  std::size_t count = 0;
  for (auto each = of_tenant.begin(); each != of_tenant.end();) {
    std::erase_if(each->second, [](const JobPointer& job) { return api::is_final(job->state()); });
    count += each->second.size();
    each = each->second.empty() ? of_tenant.erase(each) : std::next(each);
  }
  std::vector<JobPointer>& jobs = of_tenant[preset];
  if (!has_job && (jobs.size() >= static_cast<std::size_t>(bounds_.of_preset) ||
                   count >= static_cast<std::size_t>(bounds_.of_tenant))) {
    return api::make_problem(core::ErrorCode::kUnavailable,
                             "as many images as URLs may order at a time are being rendered");
  }
  auto submitted = submit();
  if (submitted && !submitted->is_replay) {
    jobs.push_back(submitted->job);
  }
  return submitted;
}

}  // namespace server
