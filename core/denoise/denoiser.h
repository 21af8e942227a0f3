/// Denoiser: computes an image with less noise from one half of a film and its features.
///
/// Each half is denoised separately: the denoised A is a function of A and the features, so it is
/// independent of B, which therefore measures its error (core/denoise/denoised_picture.h).
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/result.h"
#include "core/film/film.h"

namespace core {

using Plane = std::vector<float>;  ///< row by row
using ColorPlanes = std::array<Plane, 3>;

/// One half of an image; linear.
struct HalfPicture {
  int width = 0;
  int height = 0;
  ColorPlanes mean;
  /// Variance of the mean, summed over the channels: from the variance of the half's samples,
  /// pooled with that of its neighbours and scaled to the noise between neighbouring pixels of this
  /// half.
  Plane variance;
};

/// Features of the visible surfaces, from samples that are in neither half.
struct FeaturePicture {
  int width = 0;
  int height = 0;
  int samples = 0;       ///< at most, of each pixel
  bool has_fog = false;  ///< in front of the environment
  ColorPlanes albedo;    ///< times the transmittance of mirrors and glass in front of it
  ColorPlanes normal;    ///< world
  /// Along the path from the camera, to the last mirror or glass if only the environment is behind
  /// it; 0 where there is no surface.
  Plane depth_m;
  ColorPlanes emission;  ///< of the surface, or of the environment if there is none
  /// Variances of these means, summed over the channels.
  Plane albedo_variance;
  Plane normal_variance;
  Plane depth_variance;
  Plane emission_variance;

  /// Returns whether no sample met a surface, so that the light is that of the environment alone.
  bool is_backdrop(std::size_t pixel) const { return depth_m[pixel] == 0 && !has_fog; }

  /// Returns planes of this size, all 0.
  static FeaturePicture blank(int width, int height);
};

/// Content of a half's image: its light, its alpha as grey, or its light composited over white.
enum class HalfPart { kLight, kAlpha, kOverWhite };

/// Pre: every pixel has samples of that half. factors: of its light, per pixel
/// (core/film/set_aside.h); empty: 1. features: null, or of the same size; show where the
/// backdrop is.
HalfPicture half_picture(const FilmSnapshot& film, int half, HalfPart part = HalfPart::kLight,
                         std::span<const float> factors = {},
                         const FeaturePicture* features = nullptr);

/// Description of the denoiser of an image.
struct DenoiserFacts {
  std::string type;  ///< a row of denoisers()
  std::string version;
  std::string sha256;   ///< hex, of the file with the learnt weights; empty: none
  std::string quality;  ///< empty: there is only one
  int frames = 0;       ///< neighbours in the series that it is averaged with
};

/// Returns text such as "oidn 2.5.1, balanced, sha256 ...".
std::string to_text(const DenoiserFacts& facts);

/// FA and FB, in the order of A and B.
struct FilteredHalves {
  std::vector<ColorPlanes> planes;
  DenoiserFacts by;
};

class Denoiser {
 public:
  virtual ~Denoiser() = default;
  /// Denoises each half separately. features: null, or of the same size. Errors: kUnavailable if
  /// the denoiser failed.
  virtual Result<FilteredHalves> denoise(std::span<const HalfPicture> halves,
                                         const FeaturePicture* features,
                                         const ParallelFor& parallel) const = 0;
};

}  // namespace core
