#include "core/error/error_estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/statistics.h"

namespace core {
namespace {

/// Relative standard error of a picture's error beyond which it is called unreliable: the interval
/// of 95 % then spans more than a factor of e.
constexpr double kUnreliable = 0.25;

/// n N / (max(S, 0) + F) of a tile, and the variance of that.
struct Weighted {
  double ratio = 0;
  double variance = 0;
};

/// floor: F of one pixel.
Weighted weighted(const TileSums& tile, double floor) {
  if (!(tile.noise > 0) || tile.pixels == 0) {
    return {};
  }
  const double signal = std::max(tile.signal, 0.0);
  const double scale = signal + floor * tile.pixels;
  const double ratio = tile.pixels * tile.noise / scale;
  // A half has twice the variance q of the pixel, so that of A B is 4 q mu^2 + 4 q^2. Where S is
  // noisy N is too, and in the same direction: to add both is on the safe side.
  const double of_signal = 4 * (tile.noise * signal / tile.pixels + tile.noise_squares);
  return {ratio,
          ratio * ratio *
              (tile.noise_squares / (tile.noise * tile.noise) + of_signal / (scale * scale))};
}

}  // namespace

ErrorEstimate::Ratio ErrorEstimate::ratio_of(std::span<const TileSums> tiles, double floor) {
  Ratio out;
  double sum = 0;
  double variance = 0;
  double pixels = 0;
  out.valid = !tiles.empty();
  for (const TileSums& tile : tiles) {
    const Weighted of_tile = weighted(tile, floor);
    sum += of_tile.ratio;
    variance += of_tile.variance;
    pixels += tile.pixels;
    out.valid = out.valid && tile.has_halves;
  }
  if (out.valid && sum > 0) {
    out.value = sum / pixels;
    out.log_deviation = std::sqrt(variance) / sum;
  }
  return out;
}

float tile_error(const Film& film, int tile) {
  const TileSums sums = film.half_sums(tile);
  if (!sums.has_halves) {
    return std::numeric_limits<float>::quiet_NaN();
  }
  const double ratio = weighted(sums, 3 * error_floor(film.mean_luminance())).ratio;
  return ratio > 0 ? static_cast<float>(std::sqrt(ratio / sums.pixels)) : 0.0F;
}

ErrorEstimate::ErrorEstimate(std::span<const TileSums> tiles) {
  double light = 0;
  double pixels = 0;
  for (const TileSums& tile : tiles) {
    light += tile.luminance;
    pixels += tile.pixels;
  }
  const double floor = pixels > 0 ? 3 * error_floor(light / pixels) : 0;
  picture_ = ratio_of(tiles, floor);
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    tiles_.push_back(ratio_of(tiles.subspan(t, 1), floor));
  }
}

ErrorInterval ErrorEstimate::image(double confidence) const {
  ErrorInterval out;
  if (!picture_.valid) {
    out.relative_rmse = out.low = out.high = std::numeric_limits<double>::quiet_NaN();
    return out;
  }
  out.relative_rmse = std::sqrt(picture_.value);
  const double quantile = normal_quantile(0.5 + 0.5 * confidence);
  const double factor = std::exp(0.5 * quantile * picture_.log_deviation);
  out.low = out.relative_rmse / factor;
  out.high = out.relative_rmse * factor;
  out.unreliable = 0.5 * picture_.log_deviation > kUnreliable;
  return out;
}

double ErrorEstimate::bound(const Ratio& ratio, double quantile) {
  if (!ratio.valid) {
    return std::numeric_limits<double>::infinity();
  }
  // The squared error of (A + B) / 2 spreads about its expected value as the estimate from (A - B)
  // / 2 does, and independently: the logarithm of their ratio has twice the variance.
  const double deviation = std::sqrt(2.0) * ratio.log_deviation;
  return std::sqrt(ratio.value) * std::exp(0.5 * quantile * deviation);
}

double ErrorEstimate::bound(double alpha) const {
  return bound(picture_, normal_quantile(1 - alpha));
}

double ErrorEstimate::worst_tile_bound(double alpha) const {
  const double quantile = normal_quantile(1 - alpha / static_cast<double>(tiles_.size()));
  double worst = 0;
  for (const Ratio& tile : tiles_) {
    worst = std::max(worst, bound(tile, quantile));
  }
  return worst;
}

}  // namespace core
