/// Maps from the unit square to sampling domains, each with its density.
///
/// u in [0,1)^2. Local frames have n = (0,0,1). Templates take a Vec2 or its lanes.
#pragma once

#include "core/math/generic.h"

namespace core {

/// Uniform on the unit disk. Source: Shirley and Chiu 1997, as in PBR 4th ed. A.5.1.
template <typename U = Vec2>
U concentric_disk(U u) noexcept {
  using F = decltype(u.x);
  const F a = 2 * u.x - 1;
  const F b = 2 * u.y - 1;
  const MaskOf<F> wide = abs(a) > abs(b);
  const F r = select(wide, a, b);
  const F part = (kPi / 4) * select(r == 0, F(0), select(wide, b, a) / r);
  F sine;
  F cosine;
  sincos(select(wide, part, kPi / 2 - part), sine, cosine);
  return {r * cosine, r * sine};
}

/// Density cos(theta) / pi. Malley's method.
template <typename U = Vec2>
Vec3Of<decltype(U::x)> cosine_hemisphere(U u) noexcept {
  const U d = concentric_disk(u);
  return {d.x, d.y, safe_sqrt(1 - d.x * d.x - d.y * d.y)};
}
template <typename F>
F cosine_hemisphere_pdf_solid_angle(F cos_theta) noexcept {
  return max(cos_theta, F(0)) * kInvPi;
}

/// Density 1 / (2 pi).
template <typename U = Vec2>
Vec3Of<decltype(U::x)> uniform_hemisphere(U u) noexcept {
  using F = decltype(u.x);
  const F r = safe_sqrt(1 - u.x * u.x);
  F sine;
  F cosine;
  sincos(kTwoPi * u.y, sine, cosine);
  return {r * cosine, r * sine, u.x};
}

/// Density 1 / (4 pi).
template <typename U>
auto uniform_sphere(U u) noexcept {
  using F = decltype(u.x);
  const F z = 1 - 2 * u.x;
  const F r = safe_sqrt(1 - z * z);
  F sin_phi;
  F cos_phi;
  sincos(kTwoPi * u.y, sin_phi, cos_phi);
  return Vec3Of<F>{r * cos_phi, r * sin_phi, z};
}

/// Returns the direction at a cosine of 1 - below, which stays accurate for narrow cones.
inline Vec3 in_cone(float below, float u) noexcept {
  const float r = safe_sqrt(below * (2 - below));
  const float phi = kTwoPi * u;
  return {r * std::cos(phi), r * std::sin(phi), 1 - below};
}

/// Returns barycentric weights of vertices 1 and 2, uniform over a triangle's area. Source: Heitz,
/// A Low-Distortion Map Between Triangle and Square, 2019.
template <typename U = Vec2>
U uniform_triangle(U u) noexcept {
  const auto low = u.x < u.y;
  const auto half = 0.5F * select(low, u.x, u.y);
  return {select(low, half, u.x - half), select(low, u.y - half, half)};
}

/// Converts a density over surface area to one over solid angle at a point distance_squared away.
inline float area_to_solid_angle(float pdf_area, float distance_squared, float cos_light) noexcept {
  return cos_light > 0 ? pdf_area * distance_squared / cos_light : 0.0F;
}

}  // namespace core
