/// Ranges of the look of an image, for queries and the command line.
#pragma once

namespace api {

struct LookRange {
  double min;
  double max;
};

/// Kelvin: those that core::WhiteBalance takes.
inline constexpr LookRange kWhiteKelvin = {1000, 40000};
inline constexpr LookRange kContrast = {0.25, 4};

}  // namespace api
