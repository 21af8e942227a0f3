/// TileLight and TileSums: sums over a tile of its half means, from which errors are estimated.
///
/// A, B: means of a pixel's halves, independent. Empty pixels (is_empty()) are not counted.
///   F = 0.05 (mean over the image of the root of the luminance of (A + B) / 2)^2
///   d = sum over channels of |A - B|,   s = sum over channels of |A| + |B| + 2 F,   r = d / s
///   D = r with the sign of A - B in the channel where they differ most
/// r is a pixel's relative difference, 0 to 1; D is its noise, of mean 0. F is a mean of roots, so
/// that neither an emitter nor a firefly sets it. Doubt pools d r and s over
/// squares of kDoubtSize pixels, anchored at the origin of the full film: where only one half has
/// found light, d r is nearly d and the quotient nearly 1; for resolved noise it is the square of
/// r. It is a triangular divergence (Le Cam 1986).
#pragma once

#include <cstdint>
#include <span>

#include "core/film/replicate_pixel.h"
#include "core/settings/settings.h"

namespace core {

inline constexpr int kTileSize = 32;

/// Side of the squares of doubt, in pixels. Of 8, 16 and 32 pixels, 16 covers best on 14 scenes.
inline constexpr int kDoubtSize = 16;

/// Returns F, from the mean over the image of the root of the luminance.
constexpr double error_floor(double mean_root) {
  constexpr double kShare = 0.05;
  return kShare * mean_root * mean_root;
}

/// Root of the luminance of a colour, for F; negative light counts as none.
double root_of_light(Rgb color);

/// d, s, r and D of a pixel that is counted.
struct PixelShare {
  double apart = 0;       ///< d
  double scale = 0;       ///< s
  double share = 0;       ///< r
  double difference = 0;  ///< D
};
PixelShare share_of_pixel(const HalfValue& a, const HalfValue& b, double floor);

struct TileLight {
  double roots = 0;          ///< summed over the counted pixels
  std::uint32_t pixels = 0;  ///< counted pixels
};

struct TileSums {
  double grain = 0;    ///< sum of r
  double squares = 0;  ///< sum of r^2
  double doubt = 0;    ///< sum over squares of n (sum of d r) / (sum of s), n its counted pixels
  double squares_of_blocks = 0;  ///< sum over squares of (sum of D)^2
  std::uint32_t pixels = 0;      ///< counted pixels
  bool has_halves = false;       ///< every pixel has samples in both halves

  TileSums& operator+=(const TileSums& other);
};

/// Computes the sums of `rect`, which lies within one tile. pixels: [pixel * replicates +
/// replicate], row by row over rect. over_white: FilmSettings::errors_over_white.
TileLight tile_light(const PixelRect& rect, std::span<const ReplicatePixel> pixels, int replicates,
                     bool over_white = false);
/// floor: F.
TileSums half_sums(const PixelRect& rect, std::span<const ReplicatePixel> pixels, int replicates,
                   double floor, bool over_white = false);

}  // namespace core
