/// Denoiser: a picture with less noise, made from one half of a film and its features.
///
/// A half alone: what a denoiser makes of A is a function of A and the features, so it is
/// independent of B, and B tells how wrong it is (core/denoise/denoised_picture.h).
#pragma once

#include <array>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/film/film.h"

namespace core {

using Plane = std::vector<float>;  ///< row by row
using ColorPlanes = std::array<Plane, 3>;

/// One half of a picture; linear.
struct HalfPicture {
  int width = 0;
  int height = 0;
  ColorPlanes mean;
  /// Of the mean, summed over the channels: from the spread of the half's own samples, pooled with
  /// that of its neighbours and scaled to what neighbouring pixels of this half differ by.
  Plane variance;
};

/// What of a film's half a picture shows: its light; its alpha, grey; or its light before white.
enum class HalfPart { kLight, kAlpha, kOverWhite };

/// Pre: every pixel has samples of that half.
HalfPicture half_picture(const FilmSnapshot& film, int half, HalfPart part = HalfPart::kLight);

/// What the surfaces are like that a picture shows, from samples that are in neither half.
struct FeaturePicture {
  int width = 0;
  int height = 0;
  ColorPlanes albedo;    ///< times what mirrors and glass before the surface let through
  ColorPlanes normal;    ///< world
  Plane depth_m;         ///< along the path from the eye; 0 where there is no surface
  ColorPlanes emission;  ///< of the surface, or of the environment behind everything
  /// Of these means, summed over the channels.
  Plane albedo_variance;
  Plane normal_variance;
  Plane depth_variance;
  Plane emission_variance;

  /// All planes at their size, black.
  static FeaturePicture blank(int width, int height);
};

/// Calls body(0) to body(count - 1), in any order, on any threads; returns when all are done.
using ParallelFor = std::function<void(int count, const std::function<void(int)>& body)>;

/// On so many threads of its own.
ParallelFor parallel_for(int threads);

/// What made a picture.
struct DenoiserFacts {
  std::string type;  ///< a row of denoisers()
  std::string version;
  std::string sha256;   ///< hex, of the file that holds what was learnt; empty: nothing was
  std::string quality;  ///< empty: there is nothing to choose
};

/// "oidn 2.5.1, balanced, sha256 ..."
std::string to_text(const DenoiserFacts& facts);

/// FA and FB of A and B, in their order.
struct FilteredHalves {
  std::vector<ColorPlanes> planes;
  DenoiserFacts by;
};

class Denoiser {
 public:
  virtual ~Denoiser() = default;
  /// Each of the halves by itself. features: null, or of the same size. Errors: kUnavailable where
  /// it failed.
  virtual Result<FilteredHalves> denoise(std::span<const HalfPicture> halves,
                                         const FeaturePicture* features,
                                         const ParallelFor& parallel) const = 0;
};

}  // namespace core
