/// Medium: what fills a volume, and how it scatters.
///
/// Source: PBR 4th ed., chapter 11; Henyey and Greenstein 1941.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/color/rgb.h"
#include "core/math/frame.h"
#include "core/math/numbers.h"
#include "core/math/vec.h"

namespace core {

/// Coefficients per metre.
struct Medium {
  Rgb sigma_t;  ///< extinction: absorption and scattering
  Rgb sigma_s;  ///< scattering
  float g = 0;  ///< mean cosine of the angle between the directions before and after

  bool scatters() const noexcept { return max_component(sigma_s) > 0; }
};

/// exp(-sigma_t * depth_m): Beer and Lambert.
inline Rgb transmittance(Rgb sigma_t, float depth_m) noexcept {
  return {std::exp(-sigma_t.r * depth_m), std::exp(-sigma_t.g * depth_m),
          std::exp(-sigma_t.b * depth_m)};
}

/// Density over solid angle of going on at this cosine to the direction before [1/sr]; its integral
/// is 1.
inline float henyey_greenstein(float cosine, float g) noexcept {
  const float base = std::max(1 + g * g - 2 * g * cosine, 1e-9F);
  return (1 - g * g) * kInvPi / (4 * base * std::sqrt(base));
}

/// A direction with that density.
inline Vec3 sample_henyey_greenstein(Vec3 direction, float g, Vec2 u) noexcept {
  constexpr float kEven = 1e-3F;  // below, the quotient loses more digits than the first terms lack
  float cosine = 0;
  if (std::fabs(g) < kEven) {
    const float x = 2 * u.x - 1;
    cosine = x + 1.5F * g * (1 - x * x);
  } else {
    const float s = (1 - g * g) / (1 - g + 2 * g * u.x);
    cosine = (1 + g * g - s * s) / (2 * g);
  }
  cosine = std::clamp(cosine, -1.0F, 1.0F);
  const float sine = std::sqrt(std::max(1 - cosine * cosine, 0.0F));
  const float phi = 2 * kPi * u.y;
  const Frame frame = frame_from_normal(direction);
  return normalize(frame.to_world({sine * std::cos(phi), sine * std::sin(phi), cosine}));
}

/// Albedo of one scattering for the colour that a deep medium shows under diffuse light.
/// Source: Kulla and Conty, Revisiting Physically Based Shading at Imageworks, 2017.
inline float single_scattering_albedo(float color, float g) noexcept {
  const float c = std::clamp(color, 0.0F, 1.0F);
  const float s = 4.09712F + 4.20863F * c - std::sqrt(9.59217F + 41.6808F * c + 17.7126F * c * c);
  return std::clamp((1 - s * s) / (1 - g * s * s), 0.0F, 1.0F);
}

}  // namespace core
