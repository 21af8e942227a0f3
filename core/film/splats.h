/// Splats: light that paths from the lights bring to pixels anywhere on the film.
///
/// A pixel's value is the mean of its camera samples plus sum / n, n being the light paths of the
/// replicate over the pixels of the full film. Sums are integers, so that they do not depend on the
/// order in which threads add. Range and resolution: a film of 64 megapixels (2^26) with 65,536
/// samples (2^16) and paths of 1,024 vertices (2^10) adds at most 2^52 splats to one pixel; below
/// 2^34 each, in units of 2^-40, they sum to less than 2^126.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/color/rgb.h"
#include "core/film/replicate_pixel.h"
#include "core/settings/settings.h"

namespace core {

__extension__ using SplatSum = __int128;

/// Of one replicate of a pixel: r, g, b in units of kSplatUnit. 48 bytes.
struct SplatPixel {
  std::array<SplatSum, 3> sum{};
};
inline constexpr float kSplatUnit = 0x1p-40F;
inline constexpr float kSplatMax = 0x1p34F;

/// What one light path adds to one pixel, as if there were one light path a pixel.
struct Splat {
  int x = 0;  ///< of the full film
  int y = 0;
  Rgb value;
  int plane = 0;  ///< 0: of the picture; k + 1: of share number k of its light
};

/// Light paths of one unit: samples [first_sample, last_sample) of every pixel of a tile of the
/// full film. The splat of a path may lie in any tile; those outside of the crop are left out.
struct LightBatch {
  int unit = 0;
  int first_sample = 0;
  int last_sample = 0;
  std::vector<std::vector<Splat>> splats;  ///< [replicate]
  std::string sums = {};               ///< of splats that were summed up, as pack_sums() made them
  std::uint64_t rejected_samples = 0;  ///< splats that are not finite or out of range
  std::uint64_t rays = 0;
  double cpu_seconds = 0;

  /// Rejects and counts what is not finite or not below kSplatMax.
  void add(int replicate, const Splat& splat);
};

void add_splat(SplatPixel& pixel, Rgb value);
/// Adds sum / paths_per_pixel to the mean of a pixel that has samples.
void fold_splats(ReplicatePixel& pixel, const SplatPixel& splats, double paths_per_pixel);

/// Of `samples` light samples, those that belong to a replicate.
constexpr std::uint64_t samples_of_replicate(int samples, int replicates, int replicate) {
  return static_cast<std::uint64_t>((samples + replicates - 1 - replicate) / replicates);
}

}  // namespace core
