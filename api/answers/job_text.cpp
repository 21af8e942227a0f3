#include "api/answers/job_text.h"

#include <nlohmann/json.hpp>

#include "api/answers/views.h"

namespace api {

std::string job_json(const JobView& job) { return job_json(job, spec_json(job.spec)); }

std::string job_json(const JobView& job, std::string_view spec) {
  std::string text;
  for (const ViewRow<JobView>& row : job_view().rows) {
    if (row.applies != nullptr && !row.applies(job)) {
      continue;
    }
    text.append(text.empty() ? "{" : ",").append("\"").append(row.name).append("\":");
    if (row.name == "spec") {
      text += spec;
    } else {
      text += dump(row.print(job));
    }
  }
  return text + "}";
}

}  // namespace api
