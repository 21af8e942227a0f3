/// Maps from the unit square to sampling domains, each with its density.
///
/// u in [0,1)^2. Local frames have n = (0,0,1).
#pragma once

#include <cmath>

#include "core/math/numbers.h"
#include "core/math/vec.h"

namespace core {

/// Uniform on the unit disk. Source: Shirley and Chiu 1997, as in PBR 4th ed. A.5.1.
inline Vec2 concentric_disk(Vec2 u) noexcept {
  const float a = 2 * u.x - 1;
  const float b = 2 * u.y - 1;
  if (a == 0 && b == 0) {
    return {0, 0};
  }
  const bool wide = std::fabs(a) > std::fabs(b);
  const float r = wide ? a : b;
  const float phi = wide ? (kPi / 4) * (b / a) : (kPi / 2) - (kPi / 4) * (a / b);
  return {r * std::cos(phi), r * std::sin(phi)};
}

/// Density cos(theta) / pi. Malley's method.
inline Vec3 cosine_hemisphere(Vec2 u) noexcept {
  const Vec2 d = concentric_disk(u);
  return {d.x, d.y, safe_sqrt(1 - d.x * d.x - d.y * d.y)};
}
inline float cosine_hemisphere_pdf_solid_angle(float cos_theta) noexcept {
  return cos_theta > 0 ? cos_theta * kInvPi : 0.0F;
}

/// Density 1 / (2 pi).
inline Vec3 uniform_hemisphere(Vec2 u) noexcept {
  const float r = safe_sqrt(1 - u.x * u.x);
  const float phi = kTwoPi * u.y;
  return {r * std::cos(phi), r * std::sin(phi), u.x};
}

/// Density 1 / (4 pi).
inline Vec3 uniform_sphere(Vec2 u) noexcept {
  const float z = 1 - 2 * u.x;
  const float r = safe_sqrt(1 - z * z);
  const float phi = kTwoPi * u.y;
  return {r * std::cos(phi), r * std::sin(phi), z};
}

/// Returns barycentric weights of vertices 1 and 2, uniform over a triangle's area. Source: Heitz,
/// A Low-Distortion Map Between Triangle and Square, 2019.
inline Vec2 uniform_triangle(Vec2 u) noexcept {
  if (u.x < u.y) {
    const float b0 = u.x * 0.5F;
    return {b0, u.y - b0};
  }
  const float b1 = u.y * 0.5F;
  return {u.x - b1, b1};
}

/// Converts a density over surface area to one over solid angle at a point distance_squared away.
inline float area_to_solid_angle(float pdf_area, float distance_squared, float cos_light) noexcept {
  return cos_light > 0 ? pdf_area * distance_squared / cos_light : 0.0F;
}

}  // namespace core
