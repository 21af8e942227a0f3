/// Splats: contributions of light paths to pixels anywhere on the film.
///
/// A pixel's value is the mean of its camera samples plus sum / n, where n is the number of light
/// paths of the replicate divided by the number of pixels of the full film. Sums are integers, so
/// they do not depend on the order in which threads add. Range and resolution: a film of 64
/// megapixels (2^26) with 65,536 samples (2^16) and paths of 1,024 vertices (2^10) adds at most
/// 2^52 splats to one pixel; each is below 2^34, in units of 2^-40, so they sum to less than 2^126.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/color/rgb.h"
#include "core/film/replicate_pixel.h"
#include "core/settings/settings.h"

namespace core {

__extension__ using SplatSum = __int128;

/// Splat sums of one replicate of a pixel: r, g, b in units of kSplatUnit. 48 bytes.
struct SplatPixel {
  std::array<SplatSum, 3> sum{};
};
inline constexpr float kSplatUnit = 0x1p-40F;
inline constexpr float kSplatMax = 0x1p34F;

/// The contribution of one light path to one pixel, as if there were one light path per pixel.
struct Splat {
  int x = 0;  ///< of the full film
  int y = 0;
  Rgb value;
  int plane = 0;  ///< 0: the image; k + 1: share k of its light
};

/// Light paths of one unit: samples [first_sample, last_sample) of every pixel of a tile of the
/// full film. Splats may lie in any tile; those outside the crop are ignored.
struct LightBatch {
  int unit = 0;
  int first_sample = 0;
  int last_sample = 0;
  std::vector<std::vector<Splat>> splats;  ///< [replicate]
  std::string sums = {};                   ///< splats already summed, as encoded by pack_sums()
  std::uint64_t rejected_samples = 0;      ///< splats that are non-finite or out of range
  std::uint64_t rays = 0;
  double cpu_seconds = 0;

  /// Adds a splat. Rejects and counts values that are non-finite or not below kSplatMax.
  void add(int replicate, const Splat& splat);
};

/// How the warning of rejected_warning() begins after its number.
inline constexpr std::string_view kRejectedWords = " samples count as zero";
/// Returns the warning of a film with rejected samples. Pre: rejected > 0.
std::string rejected_warning(std::uint64_t rejected);

void add_splat(SplatPixel& pixel, Rgb value);
/// Adds sum / paths_per_pixel to the mean of a pixel that has samples.
void fold_splats(ReplicatePixel& pixel, const SplatPixel& splats, double paths_per_pixel);

/// Returns how many of `samples` light samples belong to a replicate.
constexpr std::uint64_t samples_of_replicate(int samples, int replicates, int replicate) {
  return static_cast<std::uint64_t>((samples + replicates - 1 - replicate) / replicates);
}

}  // namespace core
