/// The text of a job whose spec is a text already: printing the spec costs more than the rest.
#pragma once

#include <string>
#include <string_view>

#include "api/answers/job_view.h"

namespace api {

/// Returns job_json(job). spec: spec_json(job.spec).
std::string job_json(const JobView& job, std::string_view spec);

}  // namespace api
