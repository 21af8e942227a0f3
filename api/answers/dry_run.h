/// Estimated cost of a job, before it is rendered.
#pragma once

#include <string>

#include "api/job/job_spec.h"

namespace api {

struct CostView {
  double seconds = 0;  ///< on an idle server
  double seconds_low = 0;
  double seconds_high = 0;
  double confidence = 0.95;  ///< of the intervals
  double cpu_seconds = 0;
  double samples_per_pixel = 0;  ///< required by the stop rules
  double memory_bytes = 0;       ///< film and scene
  double memory_bytes_low = 0;   ///< the film alone, if the scene is loaded already
  double memory_bytes_high = 0;  ///< reserved at admission: the larger of loading and rendering
  double pilot_cpu_seconds = 0;
};
struct DryRunView {
  const ParsedJob& job;
  CostView cost;
};
std::string dry_run_json(const DryRunView& dry_run);

}  // namespace api
