/// TileSums: sums over a tile of what its halves say; all that the error of a picture is made from.
///
/// With A and B the means of a pixel's halves, noise is the sum of (A - B)^2 / 4 and signal that of
/// A B, over pixels and channels. The halves are independent, so the first estimates the variance
/// of the pixels' values and the second the square of their expected values, both without bias,
/// whatever the noise and however neighbours are correlated.
#pragma once

#include <cstdint>
#include <span>

#include "core/film/replicate_pixel.h"
#include "core/settings/settings.h"

namespace core {

inline constexpr int kTileSize = 32;

struct TileSums {
  double noise = 0;
  double noise_squares = 0;  ///< sum over pixels of the square of their noise
  double signal = 0;
  double luminance = 0;      ///< of the pixels that count
  std::uint32_t pixels = 0;  ///< that count: their alpha is not 0
  bool has_halves = false;   ///< both halves of every pixel have samples
};

/// pixels: [pixel * replicates + replicate], row by row over rect, which lies within one tile.
/// over_white: FilmSettings::errors_over_white.
TileSums half_sums(const PixelRect& rect, std::span<const ReplicatePixel> pixels, int replicates,
                   bool over_white = false);

}  // namespace core
