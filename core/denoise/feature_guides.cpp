#include "core/denoise/feature_guides.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace core {
namespace {

/// Standard deviations of agreement between features; beyond three of them the agreement is 0.
/// Source: Sakai 2024 (normal); its albedo is narrower, because it filters colour with light.
constexpr float kNormalSigma = 0.1F;
constexpr float kAlbedoSigma = 0.1F;
constexpr float kDepthSigma = 0.02F;     ///< of the depth
constexpr float kEmissionSigma = 0.05F;  ///< of log(1 + emission / its mean)

/// Added to the albedo before division: black surfaces still show glossy reflections.
constexpr float kLeastAlbedo = 0.05F;

/// Returns the mean luminance of pixels with emission: from the features only, because no
/// information may pass from one half to the other.
float mean_emission(const FeaturePicture& f) {
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i < f.depth_m.size(); ++i) {
    const float y = luminance({f.emission[0][i], f.emission[1][i], f.emission[2][i]});
    sum += y > 0 ? static_cast<double>(y) : 0;
    count += y > 0 ? 1 : 0;
  }
  return sum > 0 ? static_cast<float>(sum / count) : 1;
}

}  // namespace

FeatureGuides make_guides(const FeaturePicture& f) {
  FeatureGuides out;
  const std::size_t count = f.depth_m.size();
  const auto scale = [count](const Plane& plane, float sigma) {
    Plane scaled(count);
    for (std::size_t i = 0; i < count; ++i) {
      scaled[i] = plane[i] / sigma;
    }
    return scaled;
  };
  for (std::size_t c = 0; c < 3; ++c) {
    out.scaled[c] = scale(f.normal[c], kNormalSigma);
    out.scaled[3 + c] = scale(f.albedo[c], kAlbedoSigma);
  }
  out.scaled[6].resize(count);
  out.variance.resize(count);
  out.depth = f.depth_m;
  out.depth_tolerance.resize(count);
  out.depth_slope.resize(count);
  const float light = mean_emission(f);
  const auto width = static_cast<std::size_t>(f.width);
  for (std::size_t i = 0; i < count; ++i) {
    const float emission =
        luminance({f.emission[0][i], f.emission[1][i], f.emission[2][i]}) / light;
    out.scaled[6][i] = std::log1p(std::max(emission, 0.0F)) / kEmissionSigma;
    const float emission_slope = 1 / (kEmissionSigma * light * (1 + std::max(emission, 0.0F)));
    out.variance[i] = f.normal_variance[i] / (kNormalSigma * kNormalSigma) +
                      f.albedo_variance[i] / (kAlbedoSigma * kAlbedoSigma) +
                      f.emission_variance[i] * emission_slope * emission_slope;
    const float sigma = kDepthSigma * f.depth_m[i];
    out.depth_tolerance[i] = sigma * sigma + f.depth_variance[i];
    // Take the smaller difference: the other may cross an edge.
    const auto slope = [&](std::size_t step, bool has_before, bool has_after) {
      const float none = has_before && has_after ? 1e30F : 0;
      const float before = has_before ? std::fabs(f.depth_m[i] - f.depth_m[i - step]) : none;
      const float after = has_after ? std::fabs(f.depth_m[i + step] - f.depth_m[i]) : none;
      return std::min(before, after);
    };
    const float across = slope(1, i % width > 0, i % width + 1 < width);
    const float down = slope(width, i >= width, i + width < count);
    out.depth_slope[i] = across * across + down * down;
  }
  return out;
}

ColorPlanes surface_colors(const FeaturePicture& f) {
  ColorPlanes out = f.albedo;
  for (std::size_t i = 0; i < f.depth_m.size(); ++i) {
    // The background, and emitters that reflect nothing, have no albedo to divide by. At the edges
    // of surfaces there is both: what is left without the emission is divided as on the surface.
    const bool reflects = out[0][i] + out[1][i] + out[2][i] > 0;
    for (Plane& plane : out) {
      plane[i] = reflects ? plane[i] + kLeastAlbedo : 1;
    }
  }
  return out;
}

Plane agreement_with_source(const FeaturePicture& features, const FeaturePicture& other,
                            const FrameMatch& match) {
  const FeatureGuides own = make_guides(features);
  const FeatureGuides there = make_guides(other);
  Plane out(match.source.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (match.source[i] < 0) {
      continue;
    }
    const auto j = static_cast<std::size_t>(match.source[i]);
    float squares = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const float d = (features.albedo[c][i] - other.albedo[c][j]) / kAlbedoSigma;
      squares += d * d;
    }
    const float noise =
        (features.albedo_variance[i] + other.albedo_variance[j]) / (kAlbedoSigma * kAlbedoSigma);
    const float dz = own.depth[i] + match.farther_m[i] - there.depth[j];
    const float of_depth = own.depth_tolerance[i] + there.depth_tolerance[j] +
                           std::max(own.depth_slope[i], there.depth_slope[j]) + 1e-20F;
    const float apart = squares / (1 + noise) + dz * dz / of_depth;
    const float near = std::max(1 - apart * (1 / kMostDeviations2), 0.0F);
    out[i] = near * near;
  }
  return out;
}

}  // namespace core
