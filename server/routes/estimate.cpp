#include "server/routes/estimate.h"

#include <algorithm>
#include <cmath>

#include "api/values.h"
#include "core/film/film.h"

namespace server {
namespace {

/// One path of the default length through a small scene, on one core of a machine of 2020 or so.
constexpr double kPathSeconds = 1.2e-6;
/// Each doubling of the triangles costs about this share more.
constexpr double kPerDoubling = 0.06;
/// A target without a sample count is looked at as this many samples.
constexpr double kSamplesGuess = 256;

}  // namespace

CostEstimate estimate_cost(const api::JobSpec& spec, const core::SceneSummary& facts, int threads) {
  const core::FilmSettings& film = spec.render.film;
  const core::PixelRect crop = film.crop.value_or(core::PixelRect{0, 0, film.width, film.height});
  const double pixels = static_cast<double>(crop.width) * static_cast<double>(crop.height);
  const double samples = spec.stop.samples_per_pixel.value_or(static_cast<int>(kSamplesGuess));
  const double doublings = std::log2(1 + static_cast<double>(facts.triangles));
  const double depth = std::clamp(spec.render.max_depth, 1, 8) / 6.0;
  CostEstimate cost;
  cost.cpu_seconds = pixels * samples * kPathSeconds * (1 + kPerDoubling * doublings) * depth;
  cost.seconds = cost.cpu_seconds / std::max(1, threads);
  if (spec.stop.seconds) {
    cost.seconds = std::min(cost.seconds, *spec.stop.seconds);
    cost.cpu_seconds = std::min(cost.cpu_seconds, *spec.stop.seconds * threads);
  }
  const double pixel_bytes = static_cast<double>(sizeof(core::ReplicatePixel)) * spec.render.replicates +
                             static_cast<double>(sizeof(core::AuxPixel));
  cost.bytes_memory = pixels * pixel_bytes + static_cast<double>(facts.bytes);
  return cost;
}

std::string dry_run_json(const api::ParsedJob& job, const core::SceneSummary& facts, int threads) {
  const CostEstimate cost = estimate_cost(job.spec, facts, threads);
  return "{\"spec\":" + api::dump(api::to_json(job.spec)) +
         ",\"warnings\":" + api::dump(api::Json(job.warnings)) +
         ",\"estimate\":{\"seconds\":" + api::number_text(cost.seconds) +
         ",\"cpu_seconds\":" + api::number_text(cost.cpu_seconds) +
         ",\"memory_bytes\":" + api::number_text(std::round(cost.bytes_memory)) + "}}";
}

}  // namespace server
