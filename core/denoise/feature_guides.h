/// FeatureGuides: features as the joint filter compares them.
#pragma once

#include "core/denoise/denoiser.h"

namespace core {

/// What is compared between pixels: divided by their deviation.
struct FeatureGuides {
  std::array<Plane, 7> scaled;  ///< normal, albedo, emission
  Plane variance;               ///< of these, summed
  Plane depth;
  Plane depth_tolerance;  ///< squared
  Plane depth_slope;      ///< squared, per pixel of distance
};

FeatureGuides make_guides(const FeaturePicture& features);

/// What light is divided by before it is filtered; 1 where surfaces shine themselves.
ColorPlanes surface_colors(const FeaturePicture& features);

}  // namespace core
