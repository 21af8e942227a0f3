/// How two pictures differ, and how much of it is noise.
#pragma once

#include <vector>

#include "core/base/result.h"
#include "core/compare/picture.h"

namespace core {

struct Comparison {
  double mse = 0;     ///< mean over pixels and channels of (a - b)^2
  double relmse = 0;  ///< of (a - b)^2 / (b^2 + 0.01)
  double flip = 0;    ///< mean of flip_map()
  /// Mean over pixels and channels of a - b. low, high: 95 % interval from the halves of both,
  /// pixel by pixel, or, for a side whose pixels' errors are correlated and do not add up, from its
  /// replicates' means (wide with two of them); NaN when a side does not know its error.
  double bias = 0;
  double bias_low = 0;
  double bias_high = 0;
  /// Of the z-map over the pixels that have noise. NaN as above. Two jobs that differ in nothing
  /// but their seed have mean 0, variance about 1 and 0.27 % beyond 3.
  double z_mean = 0;
  double z_variance = 0;
  double z_share_above_3 = 0;

  // Maps, row by row.
  std::vector<Rgb> difference;  ///< a - b
  std::vector<float>
      z;  ///< standard errors between the luminances; 0 where there is neither noise nor difference
  std::vector<float> flip_map;
};

/// b is the reference. Errors: kInvalidArgument when the sizes differ.
Result<Comparison> compare_pictures(const Picture& a, const Picture& b);

/// Display colours for maps, as bytes would show them: 0 black over violet and orange to 1 pale
/// yellow.
Rgb heat_color(float value) noexcept;
/// -1 blue, 0 white, 1 red.
Rgb signed_color(float value) noexcept;

}  // namespace core
