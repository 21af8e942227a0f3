/// Estimated cost of a job (dry run).
#pragma once

#include <string>

#include "api/job/job_spec.h"
#include "server/jobs/pilot.h"

namespace server {

/// Returns {"spec", "warnings", "estimate": {"seconds", "seconds_low", "seconds_high",
/// "confidence", ...}}.
std::string dry_run_json(const api::ParsedJob& job, const CostEstimate& cost);

}  // namespace server
