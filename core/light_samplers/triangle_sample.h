/// Points sampled on an emissive triangle, for one path or SIMD lanes.
#pragma once

#include "core/math/offset_ray.h"
#include "core/sampling/warp.h"

namespace core {

/// Triangles seen at a smaller cosine than this are not sampled.
inline constexpr float kCosLightLeast = 1e-7F;

/// A point on a triangle, seen from another one.
template <typename F>
struct TrianglePoint {
  Vec3Of<F> place;     ///< world [m]
  Vec3Of<F> wi_world;  ///< unit, to the place
  Vec3Of<F> target;    ///< of shadow rays: the place, moved off the triangle
  F pdf_solid_angle;   ///< uniform over the area; 0: the side that is seen emits nothing
};

/// t: has the p0, edge1, edge2, normal, area_m2, error_m and two_sided of TriangleLight.
template <typename Triangle, typename V, typename U>
auto sample_triangle(const Triangle& t, V point, U u) noexcept {
  using F = decltype(point.x);
  const auto b = uniform_triangle(u);
  TrianglePoint<F> s;
  s.place = t.p0 + t.edge1 * b.x + t.edge2 * b.y;
  const auto d = s.place - point;
  const F distance2 = dot(d, d);
  const F distance_m = sqrt(distance2);
  s.wi_world = d * (1 / distance_m);
  const F cosine = -dot(t.normal, s.wi_world);
  const auto behind = t.two_sided & (cosine < 0);
  const F cos_light = select(behind, -cosine, cosine);
  const auto valid = (distance2 > 0) & (t.area_m2 > 0) & (cos_light > kCosLightLeast);
  s.target = offset_ray(s.place, select(behind, -t.normal, t.normal),
                        plane_error_m(t.error_m, distance_m));
  s.pdf_solid_angle = select(valid, (1 / t.area_m2) * distance2 / cos_light, F(0));
  return s;
}

}  // namespace core
