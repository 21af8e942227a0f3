/// Compares two images and estimates how much of the difference is noise.
#pragma once

#include <vector>

#include "core/base/result.h"
#include "core/compare/picture.h"

namespace core {

struct Comparison {
  double mse = 0;     ///< mean over pixels and channels of (a - b)^2
  double relmse = 0;  ///< mean of (a - b)^2 / (b^2 + 0.01)
  double flip = 0;    ///< mean of flip_map()
  /// Mean over pixels and channels of a - b. low, high: 95% interval, from the halves of both
  /// images pixel by pixel; if the errors of a side's pixels are correlated, so that variances do
  /// not add up, from the means of its replicates (wide with two of them). NaN if the error of a
  /// side is unknown.
  double bias = 0;
  double bias_low = 0;
  double bias_high = 0;
  /// Mean of the z-map over pixels with noise. NaN as above. Two jobs that differ only in their
  /// seed have mean 0, variance about 1 and 0.27% beyond 3.
  double z_mean = 0;
  double z_variance = 0;
  double z_share_above_3 = 0;

  // Maps, row by row.
  std::vector<Rgb> difference;  ///< a - b
  std::vector<float> z;  ///< difference of the luminances in standard errors; 0 if there is neither
                         ///< noise nor difference
  std::vector<float> flip_map;
};

/// Compares with b as the reference. Errors: kInvalidArgument if the sizes differ.
Result<Comparison> compare_pictures(const Picture& a, const Picture& b);

/// Returns the display colour (sRGB values) of a map: 0 black over violet and orange to 1 pale
/// yellow.
Rgb heat_color(float value) noexcept;
/// Returns the display colour of a signed value: -1 blue, 0 white, 1 red.
Rgb signed_color(float value) noexcept;

}  // namespace core
