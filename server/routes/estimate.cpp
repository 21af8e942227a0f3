#include "server/routes/estimate.h"

#include "api/answers/dry_run.h"

namespace server {

std::string dry_run_json(const api::ParsedJob& job, const CostEstimate& cost) {
  return api::dry_run_json({.job = job,
                            .cost = {.seconds = cost.seconds,
                                     .seconds_low = cost.seconds_low,
                                     .seconds_high = cost.seconds_high,
                                     .cpu_seconds = cost.cpu_seconds,
                                     .samples_per_pixel = cost.samples_per_pixel,
                                     .memory_bytes = cost.memory_bytes,
                                     .memory_bytes_low = cost.memory_bytes_low,
                                     .memory_bytes_high = cost.memory_bytes_high,
                                     .pilot_cpu_seconds = cost.pilot_cpu_seconds}});
}

}  // namespace server
