/// Medium: the coefficients of a participating medium, and its phase function.
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
  Rgb sigma_t;  ///< extinction: absorption + scattering
  Rgb sigma_s;  ///< scattering
  float g = 0;  ///< mean cosine of the scattering angle

  bool scatters() const noexcept { return max_component(sigma_s) > 0; }
};

/// exp(-sigma_t * depth_m): the Beer-Lambert law.
inline Rgb transmittance(Rgb sigma_t, float depth_m) noexcept {
  return {std::exp(-sigma_t.r * depth_m), std::exp(-sigma_t.g * depth_m),
          std::exp(-sigma_t.b * depth_m)};
}

/// Phase function at the cosine of the scattering angle [1/sr]; it integrates to 1 over solid
/// angle.
inline float henyey_greenstein(float cosine, float g) noexcept {
  const float base = std::max(1 + g * g - 2 * g * cosine, 1e-9F);
  return (1 - g * g) * kInvPi / (4 * base * std::sqrt(base));
}

/// Samples a direction from the phase function.
inline Vec3 sample_henyey_greenstein(Vec3 direction, float g, Vec2 u) noexcept {
  // Below this, the quotient loses more digits than the truncated series.
  constexpr float kEven = 1e-3F;
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

/// Returns the single-scattering albedo that gives an optically thick medium this colour under
/// diffuse light. Source: Kulla and Conty, Revisiting Physically Based Shading at Imageworks, 2017.
inline float single_scattering_albedo(float color, float g) noexcept {
  const float c = std::clamp(color, 0.0F, 1.0F);
  const float s = 4.09712F + 4.20863F * c - std::sqrt(9.59217F + 41.6808F * c + 17.7126F * c * c);
  return std::clamp((1 - s * s) / (1 - g * s * s), 0.0F, 1.0F);
}

}  // namespace core
