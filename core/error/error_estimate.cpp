#include "core/error/error_estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/statistics.h"

namespace core {
namespace {

/// Relative standard error of an image's error above which it is marked unreliable: the 95%
/// interval then spans more than a factor of e.
constexpr double kUnreliable = 0.25;

/// n N / (max(S, 0) + F) of a tile, and its variance.
struct Weighted {
  double ratio = 0;
  double variance = 0;
};

/// energy: N with its variance; floor: F of one pixel.
Weighted weighted(const TileSums& tile, double energy, double variance, double floor) {
  const double signal = std::max(tile.signal, 0.0);
  const double scale = signal + floor * tile.pixels;
  if (tile.pixels == 0 || !(scale > 0)) {
    return {};
  }
  const double ratio = tile.pixels * energy / scale;
  // A half has twice the variance q of the pixel, so A B has the variance 4 q mu^2 + 4 q^2. Where S
  // is noisy, so is N, in the same direction: adding both variances is conservative.
  const double of_signal = 4 * (tile.noise * signal / tile.pixels + tile.noise_squares);
  return {ratio,
          (tile.pixels * static_cast<double>(tile.pixels) * variance + ratio * ratio * of_signal) /
              (scale * scale)};
}

Weighted weighted(const TileSums& tile, double floor) {
  return tile.noise > 0 ? weighted(tile, tile.noise, tile.noise_squares, floor) : Weighted{};
}

/// Returns F of one pixel.
double floor_of(std::span<const TileSums> tiles) {
  double light = 0;
  double pixels = 0;
  for (const TileSums& tile : tiles) {
    light += tile.luminance;
    pixels += tile.pixels;
  }
  return pixels > 0 ? 3 * error_floor(light / pixels) : 0;
}

/// N / (S + F) of a denoised image, and its standard deviation.
struct SignedRatio {
  double value = 0;
  double deviation = 0;
  bool valid = false;
};
SignedRatio denoised_ratio(std::span<const TileSums> tiles, std::span<const TileEnergy> energies) {
  const double floor = floor_of(tiles);
  SignedRatio out;
  out.valid = !tiles.empty();
  double sum = 0;
  double squares = 0;
  double pixels = 0;
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    const Weighted of_tile = weighted(tiles[t], energies[t].energy, energies[t].variance, floor);
    sum += of_tile.ratio;
    squares += of_tile.variance;
    pixels += tiles[t].pixels;
    out.valid = out.valid && tiles[t].has_halves;
  }
  if (pixels > 0) {
    out.value = sum / pixels;
    out.deviation = std::sqrt(squares) / pixels;
  }
  return out;
}

}  // namespace

ErrorInterval denoised_error(std::span<const TileSums> tiles, std::span<const TileEnergy> energies,
                             double confidence) {
  ErrorInterval out;
  const SignedRatio ratio = denoised_ratio(tiles, energies);
  if (!ratio.valid) {
    out.relative_rmse = out.low = out.high = std::numeric_limits<double>::quiet_NaN();
    return out;
  }
  const double reach = normal_quantile(0.5 + 0.5 * confidence) * ratio.deviation;
  out.relative_rmse = std::sqrt(std::max(ratio.value, 0.0));
  out.low = std::sqrt(std::max(ratio.value - reach, 0.0));
  out.high = std::sqrt(std::max(ratio.value + reach, 0.0));
  out.unreliable = 0.5 * ratio.deviation > kUnreliable * ratio.value;
  return out;
}

double denoised_bound(std::span<const TileSums> tiles, std::span<const TileEnergy> energies,
                      double alpha) {
  const SignedRatio ratio = denoised_ratio(tiles, energies);
  if (!ratio.valid) {
    return std::numeric_limits<double>::infinity();
  }
  return std::sqrt(std::max(ratio.value + normal_quantile(1 - alpha) * ratio.deviation, 0.0));
}

std::vector<double> denoised_tile_errors(std::span<const TileSums> tiles,
                                         std::span<const TileEnergy> energies) {
  const double floor = floor_of(tiles);
  std::vector<double> out;
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    const double ratio = weighted(tiles[t], energies[t].energy, 0, floor).ratio;
    out.push_back(ratio > 0 ? std::sqrt(ratio / tiles[t].pixels) : 0.0);
  }
  return out;
}

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
  const double floor = floor_of(tiles);
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
  // The squared error of (A + B) / 2 has the same distribution around its expected value as the
  // estimate from (A - B) / 2, and is independent: the logarithm of their ratio has twice the
  // variance.
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
