/// ErrorEstimate: how wrong a picture still is, by the sums of its halves.
///
/// A tile's relative error is sqrt(N / (max(S, 0) + F)): N the sum of (A - B)^2 / 4 and S that of
/// A B over its pixels and channels, A and B being the means of a pixel's halves; F = 3 n (0.05
/// L)^2 the floor, n the tile's pixels whose alpha is not 0, L the mean luminance of such pixels of
/// the picture. A picture's error is the root of the mean of that ratio over its tiles, weighted by
/// n: the ratio of noise to signal of the average tile, whatever the exposure.
///
/// Intervals are log-normal. The variance of N is taken to be the sum of the squares of the pixels'
/// terms: right where rare events carry the noise, 1.5 times too much where it is Gaussian, so that
/// some correlation of neighbours (zsobol, restir) is covered. That of S is added; it matters where
/// errors are as large as the light. A jackknife over blocks counts the picture's own structure as
/// noise; measured by tests/bench/run --coverage.
#pragma once

#include <span>
#include <vector>

#include "core/film/film.h"
#include "core/film/half_sums.h"

namespace core {

/// Regulariser of the squared expected value of a pixel, one channel: noise in dark areas is
/// measured relative to at least a twentieth of the picture's mean luminance.
constexpr double error_floor(double mean_luminance) {
  constexpr double kShare = 0.05;
  return kShare * mean_luminance * kShare * mean_luminance;
}

struct ErrorInterval {
  double relative_rmse = 0;  ///< NaN when a half is missing
  double low = 0;            ///< of the confidence interval of what pictures like it are off by
  double high = 0;
  bool unreliable = false;  ///< few pixels carry most of it
};

/// Replaces a tile's N if the image is not the mean of the film's samples: the sum of m
/// (core/denoise/denoised_picture.h), of either sign.
struct TileEnergy {
  double energy = 0;
  double variance = 0;  ///< of the energy, about the error of this image
};

/// Relative error of such a picture; the interval, from the variance of the sums, is that of what
/// this very picture is off by. N may be negative, so it is symmetric in the square of the error
/// and ends at 0. The floor and S are the plain picture's, so that both errors compare. tiles,
/// energies: of the whole picture.
ErrorInterval denoised_error(std::span<const TileSums> tiles, std::span<const TileEnergy> energies,
                             double confidence);
/// Its upper bound alone; exceeded with probability alpha at most.
double denoised_bound(std::span<const TileSums> tiles, std::span<const TileEnergy> energies,
                      double alpha);

/// The same of each tile, without intervals.
std::vector<double> denoised_tile_errors(std::span<const TileSums> tiles,
                                         std::span<const TileEnergy> energies);

/// Relative error of one tile of a picture; NaN when a half is missing.
float tile_error(const Film& film, int tile);

class ErrorEstimate {
 public:
  /// tiles: of the whole picture.
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
