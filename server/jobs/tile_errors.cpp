#include "server/jobs/tile_errors.h"

#include <algorithm>
#include <limits>

#include "core/film/error_estimate.h"

namespace server {
namespace {

/// Wider would be a little better, and dearer: the rim is estimated too.
constexpr int kRim = 8;
constexpr double kConfidence = 0.95;

core::PixelRect with_rim(core::PixelRect tile, core::PixelRect crop) {
  const int x0 = std::max(tile.x - kRim, crop.x);
  const int y0 = std::max(tile.y - kRim, crop.y);
  const int x1 = std::min(tile.x + tile.width + kRim, crop.x + crop.width);
  const int y1 = std::min(tile.y + tile.height + kRim, crop.y + crop.height);
  return {x0, y0, x1 - x0, y1 - y0};
}

float estimate(const core::Film& film, int tile) {
  // With one sample there is one half, and nothing to compare.
  if (film.tile_samples(tile) < 2) {
    return std::numeric_limits<float>::quiet_NaN();
  }
  const core::PixelRect rect = film.tile_rect(tile);
  const core::ErrorEstimate rimmed(film.snapshot(with_rim(rect, film.crop())));
  if (rimmed.valid()) {
    return static_cast<float>(rimmed.region(rect, kConfidence).relative_rmse);
  }
  // A neighbour is not that far.
  const core::ErrorEstimate alone(film.snapshot(rect));
  return static_cast<float>(alone.region(rect, kConfidence).relative_rmse);
}

}  // namespace

float TileErrors::of(const core::Film& film, int tile) {
  const std::uint32_t revision = film.tile_revision(tile);
  {
    const core::MutexLock lock(mutex_);
    const auto found = known_.find(tile);
    if (found != known_.end() && found->second.revision == revision) {
      return found->second.error;
    }
  }
  const float error = estimate(film, tile);
  const core::MutexLock lock(mutex_);
  known_[tile] = Known{.revision = revision, .error = error};
  return error;
}

}  // namespace server
