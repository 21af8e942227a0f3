#include "server/routes/estimate.h"

#include <cmath>

#include <nlohmann/json.hpp>

#include "api/values.h"

namespace server {

std::string dry_run_json(const api::ParsedJob& job, const CostEstimate& cost) {
  return api::dump({{"spec", api::to_json(job.spec)},
                    {"warnings", job.warnings},
                    {"estimate",
                     {{"seconds", api::number_json(cost.seconds)},
                      {"seconds_low", api::number_json(cost.seconds_low)},
                      {"seconds_high", api::number_json(cost.seconds_high)},
                      {"confidence", 0.95},
                      {"cpu_seconds", api::number_json(cost.cpu_seconds)},
                      {"samples_per_pixel", api::number_json(cost.samples_per_pixel)},
                      {"memory_bytes", std::round(cost.memory_bytes)},
                      {"memory_bytes_low", std::round(cost.memory_bytes_low)},
                      {"memory_bytes_high", std::round(cost.memory_bytes_high)},
                      {"pilot_cpu_seconds", api::number_json(cost.pilot_cpu_seconds)}}}});
}

}  // namespace server
