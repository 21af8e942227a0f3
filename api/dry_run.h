/// What a job will cost, said before it is done.
#pragma once

#include <string>

#include "api/job_spec.h"

namespace api {

struct CostView {
  double seconds = 0;  ///< on an idle server
  double seconds_low = 0;
  double seconds_high = 0;
  double confidence = 0.95;  ///< of the interval
  double cpu_seconds = 0;
  double samples_per_pixel = 0;  ///< that the stop rules will need
  double memory_bytes = 0;       ///< film and scene
  double memory_bytes_low = 0;   ///< the film alone: the scene may be loaded already
  double memory_bytes_high = 0;  ///< what it is admitted with: while it is loaded, or renders
  double pilot_cpu_seconds = 0;
};
struct DryRunView {
  const ParsedJob& job;
  CostView cost;
};
std::string dry_run_json(const DryRunView& dry_run);

}  // namespace api
