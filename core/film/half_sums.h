/// TileSums: sums over a tile of its half means, from which errors are estimated.
///
/// With A and B the means of a pixel's halves, noise is the sum of (A - B)^2 / 4 over pixels and
/// channels, and signal is the sum of A B. The halves are independent, so noise is an unbiased
/// estimate of the variance of the pixel values, and signal of their squared expected values, for
/// any noise and any correlation between neighbours.
#pragma once

#include <cstdint>
#include <span>

#include "core/film/replicate_pixel.h"
#include "core/settings/settings.h"

namespace core {

inline constexpr int kTileSize = 32;

struct TileSums {
  double noise = 0;
  double noise_squares = 0;  ///< sum over pixels of the squared pixel noise
  double signal = 0;
  double luminance = 0;      ///< summed over the counted pixels
  std::uint32_t pixels = 0;  ///< counted pixels: those with nonzero alpha
  bool has_halves = false;   ///< every pixel has samples in both halves
};

/// Computes the sums of `rect`, which lies within one tile. pixels: [pixel * replicates +
/// replicate], row by row over rect. over_white: FilmSettings::errors_over_white.
TileSums half_sums(const PixelRect& rect, std::span<const ReplicatePixel> pixels, int replicates,
                   bool over_white = false);

}  // namespace core
