#include "core/error/error_estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

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
  double squares = sums.squares;
  if (errors == PixelErrors::kCorrelated) {
    const double mean = mean_over(sums, sums.grain);
    const double blocks = sums.squares_of_blocks - 2 * mean * sums.products_of_blocks +
                          mean * mean * sums.pixels_of_blocks;
    squares = std::max(squares, blocks);
  }
  return mean_over(sums, normal_quantile(0.5 + 0.5 * confidence) * std::sqrt(2 * squares));
}

ErrorInterval interval_of(const TileSums& sums, PixelErrors errors, double confidence) {
  return sums.has_halves ? error_interval(mean_over(sums, sums.grain), mean_over(sums, sums.doubt),
                                          reach_of(sums, errors, confidence))
                         : unknown_error();
}

}  // namespace

ErrorInterval unknown_error() { return {kNan, kNan, kNan, kNan, kNan, kNan, false}; }

ErrorInterval error_interval(double grain, double doubt, double reach) {
  return {.relative = std::min(grain + 0.5 * doubt, 1.0),
          .low = std::max(grain - std::max(grain, 0.5) * doubt - reach, 0.0),
          .high = std::min(grain + doubt + reach, 1.0),
          .grain = grain,
          .doubt = doubt,
          .reach = reach,
          .unreliable = doubt > grain};
}

ErrorInterval denoised_error(std::span<const TileSums> plain, std::span<const double> roots,
                             PixelErrors errors, double confidence) {
  constexpr double kAtEdges = kMeanOfRoot * kMeanOfRoot;
  const TileSums sums = sum_of(plain);
  if (!sums.has_halves) {
    return unknown_error();
  }
  const double root = mean_over(sums, std::accumulate(roots.begin(), roots.end(), 0.0));
  const double doubt = mean_over(sums, sums.doubt);
  const double reach = reach_of(sums, errors, confidence);
  return {.relative = kMeanOfRoot * root,
          .low = std::max(kAtEdges * root * (1 - doubt) - reach, 0.0),
          .high = std::min(root + doubt + reach, 1.0),
          .grain = kMeanOfRoot * root,
          .doubt = doubt,
          .reach = reach,
          .unreliable = doubt > kMeanOfRoot * root};
}

float tile_error(const Film& film, int tile) {
  return static_cast<float>(interval_of(film.half_sums(tile), film.errors(), 0.95).relative);
}

ErrorEstimate::ErrorEstimate(std::span<const TileSums> tiles, PixelErrors errors)
    : tiles_(tiles.begin(), tiles.end()), errors_(errors) {}

ErrorInterval ErrorEstimate::image(double confidence) const {
  return interval_of(sum_of(tiles_), errors_, confidence);
}

double ErrorEstimate::worst_tile(double confidence) const {
  const double each =
      1 - (1 - confidence) / static_cast<double>(std::max<std::size_t>(tiles_.size(), 1));
  double worst = tiles_.empty() ? kNan : 0;
  for (const TileSums& tile : tiles_) {
    const double high = interval_of(tile, errors_, each).high;
    worst = worst < high || std::isnan(high) ? high : worst;
  }
  return worst;
}

}  // namespace core
