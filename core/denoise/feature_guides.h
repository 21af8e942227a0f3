/// FeatureGuides: features as the joint filter compares them.
#pragma once

#include "core/denoise/denoiser.h"
#include "core/denoise/frame_match.h"

namespace core {

/// Features compared between pixels, divided by their standard deviations.
struct FeatureGuides {
  std::array<Plane, 7> scaled;  ///< normal, albedo, emission
  Plane variance;               ///< sum of the variances of `scaled`
  Plane depth;
  Plane depth_tolerance;  ///< squared
  Plane depth_slope;      ///< squared, per pixel of distance
};

/// Features that differ by more than three standard deviations have agreement 0.
inline constexpr float kMostDeviations2 = 9;

FeatureGuides make_guides(const FeaturePicture& features);

/// Returns the colours that light without emission is divided by before it is filtered; 1 where
/// nothing reflects.
ColorPlanes surface_colors(const FeaturePicture& features);

/// Returns the agreement, 0 to 1, between each pixel and its source in another image: albedo and
/// depth, as far as the match expects them to change. Surfaces turn, so that normals may differ.
Plane agreement_with_source(const FeaturePicture& features, const FeaturePicture& other,
                            const FrameMatch& match);

}  // namespace core
