/// ErrorEstimate: the error of an image, estimated from sums over its two halves.
///
/// The relative error of a tile is sqrt(N / (max(S, 0) + F)). N is the sum of (A - B)^2 / 4 and S
/// that of A B over its pixels and channels, where A and B are the means of a pixel's halves. F =
/// 3 n (0.05 L)^2 is the floor, n the number of pixels in the tile whose alpha is not 0, L the mean
/// luminance of such pixels in the image. The error of an image is the square root of the mean of
/// that ratio over its tiles, weighted by n: the noise-to-signal ratio of the average tile,
/// independent of the exposure.
///
/// Intervals are log-normal. The variance of N is estimated by the sum of the squares of the
/// pixels' terms: correct if rare events dominate the noise, 1.5 times too large if it is Gaussian,
/// which allows for some correlation of neighbours (zsobol, restir). The variance of S is added; it
/// matters where errors are as large as the light. A jackknife over blocks is not used, because it
/// counts the image's structure as noise. Measured by tests/bench/run --coverage.
#pragma once

#include <span>
#include <vector>

#include "core/film/film.h"
#include "core/film/half_sums.h"

namespace core {

/// Regulariser of the squared expected value of a pixel, one channel: noise in dark areas is
/// measured relative to at least a twentieth of the image's mean luminance.
constexpr double error_floor(double mean_luminance) {
  constexpr double kShare = 0.05;
  return kShare * mean_luminance * kShare * mean_luminance;
}

struct ErrorInterval {
  double relative_rmse = 0;  ///< NaN if a half is missing
  double low = 0;            ///< confidence interval of the error of such images
  double high = 0;
  bool unreliable = false;  ///< few pixels carry most of it
};

/// Replaces a tile's N if the image is not the mean of the film's samples: the sum of m
/// (core/denoise/denoised_picture.h), of either sign.
struct TileEnergy {
  double energy = 0;
  double variance = 0;  ///< of the energy, about the error of this image
};

/// Returns the relative error of such an image. The interval, from the variance of the sums, is
/// that of the error of this image. N may be negative, so the interval is symmetric in the square
/// of the error and ends at 0. The floor and S are those of the plain image, so that the two errors
/// can be compared. tiles, energies: of the whole image.
ErrorInterval denoised_error(std::span<const TileSums> tiles, std::span<const TileEnergy> energies,
                             double confidence);
/// Returns only its upper bound, exceeded with probability at most alpha.
double denoised_bound(std::span<const TileSums> tiles, std::span<const TileEnergy> energies,
                      double alpha);

/// Returns the same for each tile, without intervals.
std::vector<double> denoised_tile_errors(std::span<const TileSums> tiles,
                                         std::span<const TileEnergy> energies);

/// Returns the relative error of one tile of an image; NaN if a half is missing.
float tile_error(const Film& film, int tile);

class ErrorEstimate {
 public:
  /// tiles: of the whole image.
  explicit ErrorEstimate(std::span<const TileSums> tiles);
  explicit ErrorEstimate(const Film& film) : ErrorEstimate(film.half_sums()) {}

  bool valid() const noexcept { return picture_.valid; }
  ErrorInterval image(double confidence) const;

  /// Returns an upper bound of the error of this image (not of the mean error of such images), with
  /// I - mu in place of the differences of the halves; exceeded with probability at most alpha.
  double bound(double alpha) const;
  /// Returns the largest such bound of any tile; alpha is divided among the tiles.
  double worst_tile_bound(double alpha) const;

 private:
  /// The ratio N / (S + F), whose square root is the error.
  struct Ratio {
    double value = 0;
    double log_deviation = 0;  ///< standard deviation of its logarithm
    bool valid = false;
  };
  static Ratio ratio_of(std::span<const TileSums> tiles, double floor);
  static double bound(const Ratio& ratio, double quantile);
  Ratio picture_;
  std::vector<Ratio> tiles_;
};

}  // namespace core
