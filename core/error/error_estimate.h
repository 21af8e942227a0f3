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

/// What is added to the square of a pixel's expected value, one channel, so that noise in the dark
/// counts against a twentieth of the picture's brightness at least.
constexpr double error_floor(double mean_luminance) {
  constexpr double kShare = 0.05;
  return kShare * mean_luminance * kShare * mean_luminance;
}

struct ErrorInterval {
  double relative_rmse = 0;  ///< NaN when a half is missing
  double low = 0;            ///< of the confidence interval of what pictures like it are off by
  double high = 0;
  bool unreliable = false;  ///< few places carry it
};

/// Relative error of one tile of a picture; NaN when a half is missing.
float tile_error(const Film& film, int tile);

class ErrorEstimate {
 public:
  /// tiles: of the whole picture.
  explicit ErrorEstimate(std::span<const TileSums> tiles);
  explicit ErrorEstimate(const Film& film) : ErrorEstimate(film.half_sums()) {}

  bool valid() const noexcept { return picture_.valid; }
  ErrorInterval image(double confidence) const;

  /// What this very picture is off by, with I - mu in place of the halves' differences, is more
  /// with probability alpha at most.
  double bound(double alpha) const;
  /// The largest of such bounds of the tiles; alpha is divided over them.
  double worst_tile_bound(double alpha) const;

 private:
  /// Of the ratio N / (S + F), whose root is the error.
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
