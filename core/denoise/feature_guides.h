/// FeatureGuides: features as the joint filter compares them.
#pragma once

#include "core/denoise/denoiser.h"

namespace core {

/// Features compared between pixels, divided by their standard deviations.
struct FeatureGuides {
  std::array<Plane, 7> scaled;  ///< normal, albedo, emission
  Plane variance;               ///< sum of the variances of `scaled`
  Plane depth;
  Plane depth_tolerance;  ///< squared
  Plane depth_slope;      ///< squared, per pixel of distance
};

FeatureGuides make_guides(const FeaturePicture& features);

/// Returns the colours that light without emission is divided by before it is filtered; 1 where
/// nothing reflects.
ColorPlanes surface_colors(const FeaturePicture& features);

}  // namespace core
