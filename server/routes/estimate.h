/// What a job will cost, said before it is done: a guess from its numbers, without a pilot.
#pragma once

#include <string>

#include "api/job_spec.h"
#include "core/scene/scene.h"

namespace server {

struct CostEstimate {
  double cpu_seconds = 0;
  double seconds = 0;       ///< On an idle server with that many threads.
  double bytes_memory = 0;  ///< Film and scene.
};
CostEstimate estimate_cost(const api::JobSpec& spec, const core::SceneSummary& facts, int threads);

/// {"spec", "warnings", "estimate": {"seconds", "cpu_seconds", "memory_bytes"}}.
std::string dry_run_json(const api::ParsedJob& job, const core::SceneSummary& facts, int threads);

}  // namespace server
