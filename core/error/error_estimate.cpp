#include "core/error/error_estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "core/base/statistics.h"

namespace core {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TileSums sum_of(std::span<const TileSums> tiles) {
  TileSums out;
  out.has_halves = !tiles.empty();
  for (const TileSums& tile : tiles) {
    out += tile;
  }
  return out;
}

double mean_over(const TileSums& sums, double sum) {
  return sums.pixels > 0 ? sum / sums.pixels : 0;
}

/// Returns z.
double reach_of(const TileSums& sums, PixelErrors errors, double confidence) {
  const double squares = errors == PixelErrors::kCorrelated
                             ? std::max(sums.squares, sums.squares_of_blocks)
                             : sums.squares;
  return mean_over(sums, normal_quantile(0.5 + 0.5 * confidence) * std::sqrt(2 * squares));
}

ErrorInterval interval_of(const TileSums& sums, PixelErrors errors, double confidence) {
  return sums.has_halves ? error_interval(mean_over(sums, sums.grain), mean_over(sums, sums.doubt),
                                          reach_of(sums, errors, confidence))
                         : unknown_error();
}

}  // namespace

ErrorInterval unknown_error() { return {kNan, kNan, kNan, kNan, kNan, kNan, false, {}}; }

ErrorInterval error_interval(double grain, double doubt, double reach, ErrorForm form) {
  const bool is_of_halves = form == ErrorForm::kHalves;
  const double root = grain / kMeanOfRoot;
  const double low =
      is_of_halves ? grain - std::max(grain, 0.5) * doubt : kMeanOfRoot * grain * (1 - doubt);
  const double high = (is_of_halves ? grain : root) + doubt;
  return {.relative = std::min(is_of_halves ? grain + 0.5 * doubt : grain, 1.0),
          .low = std::max(low - reach, 0.0),
          .high = std::min(high + reach, 1.0),
          .grain = grain,
          .doubt = doubt,
          .reach = reach,
          .unreliable = doubt > grain,
          .form = form};
}

ErrorInterval error_of_roots(std::span<const TileSums> references, const ErrorRoots& roots,
                             PixelErrors errors, double confidence) {
  const TileSums sums = sum_of(references);
  if (!sums.has_halves) {
    return unknown_error();
  }
  const double grain =
      mean_over(sums, std::accumulate(roots.tiles.begin(), roots.tiles.end(), 0.0));
  const double reach = normal_quantile(0.5 + 0.5 * confidence) * roots.deviation;
  return error_interval(grain, mean_over(sums, sums.doubt),
                        reach_of(sums, errors, confidence) + reach, ErrorForm::kSquares);
}

float tile_error(const Film& film, int tile) {
  return static_cast<float>(interval_of(film.half_sums(tile), film.errors(), 0.95).relative);
}

ErrorEstimate::ErrorEstimate(std::span<const TileSums> tiles, PixelErrors errors)
    : tiles_(tiles.begin(), tiles.end()), errors_(errors) {}

ErrorEstimate::ErrorEstimate(std::span<const TileSums> references, ErrorRoots roots,
                             PixelErrors errors)
    : tiles_(references.begin(), references.end()), roots_(std::move(roots)), errors_(errors) {}

ErrorInterval ErrorEstimate::image(double confidence) const {
  return roots_ ? error_of_roots(tiles_, *roots_, errors_, confidence)
                : interval_of(sum_of(tiles_), errors_, confidence);
}

double ErrorEstimate::worst_tile(double confidence) const {
  const double each =
      1 - (1 - confidence) / static_cast<double>(std::max<std::size_t>(tiles_.size(), 1));
  double worst = tiles_.empty() ? kNan : 0;
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    const ErrorInterval tile =
        roots_ ? error_of_roots({&tiles_[t], 1}, {{roots_->tiles[t]}, 0}, errors_, each)
               : interval_of(tiles_[t], errors_, each);
    worst = worst < tile.high || std::isnan(tile.high) ? tile.high : worst;
  }
  return worst;
}

}  // namespace core
