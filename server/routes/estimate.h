/// What a job will cost, said before it is done.
#pragma once

#include <string>

#include "api/job_spec.h"
#include "server/jobs/pilot.h"

namespace server {

/// {"spec", "warnings", "estimate": {"seconds", "seconds_low", "seconds_high", "confidence", ...}}.
std::string dry_run_json(const api::ParsedJob& job, const CostEstimate& cost);

}  // namespace server
