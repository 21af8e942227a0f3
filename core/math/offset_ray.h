/// Offsets ray origins from surfaces; all rays that leave a surface use this.
///
/// A step off a surface exceeds the distance that rounding may put between a point computed from
/// the triangle's vertices and the plane that an intersector sees, and is no longer than that: it
/// has no length of its own, so that scenes of any size look alike. Source: Pharr, Jakob and
/// Humphreys, PBR 4th ed., 6.8 (Managing Rounding Error). The bound is linear in
/// - the coordinates of the point, which is a sum of vertices times barycentric coordinates,
/// - the edges of the triangle: intersectors subtract the ray's origin from the vertices,
/// - their lengths over the triangle's height, up to 64: the normal of a sliver is inexact.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/math/generic.h"
#include "core/math/transform.h"

namespace core {

/// Error of a distance to a plane relative to the lengths above: 6 roundings of 2^-24. Embree's
/// robust kernels hit the triangle that a ray leaves at 2 in 3e-5 of cases and at 4 in none of
/// 1e6 (random triangles and instances); few_triangles.cpp needs 3.
inline constexpr float kPlaneError = 6 * 0x1p-24F;
inline constexpr float kSliverShare = 1.0F / 8;  ///< of that ratio: 1/8 suffices by the same count
inline constexpr float kSliverMost = 8;

template <typename V = Vec3>
auto taxicab(V a) noexcept {
  return abs(a.x) + abs(a.y) + abs(a.z);
}

/// How an instance magnifies rounding: rays are transformed to its space, vertices back.
struct InstanceError {
  float spread = 1;   ///< largest row sum of |A| |A^-1|, A the linear part; 1 without an instance
  float place_m = 0;  ///< taxicab length of the translation
};

/// Pre: the determinant is not 0.
inline InstanceError instance_error(const Transform& to_world) noexcept {
  const Vec3 column[3] = {to_world.x, to_world.y, to_world.z};
  const float over = 1 / to_world.determinant();
  const Vec3 row[3] = {cross(column[1], column[2]) * over, cross(column[2], column[0]) * over,
                       cross(column[0], column[1]) * over};
  InstanceError out = {0, taxicab(to_world.t)};
  for (int i = 0; i < 3; ++i) {
    float sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      sum += std::fabs(column[k][i]) * taxicab(row[k]);
    }
    out.spread = std::max(out.spread, sum);
  }
  return out;
}

/// Returns the step off a triangle at point p, in metres. twice_area: length of the edges' cross
/// product.
template <typename V, typename F>
F plane_error_m(V p, V edge1, V edge2, F twice_area, F spread, F place_m) noexcept {
  const F a = taxicab(edge1);
  const F b = taxicab(edge2);
  const F sliver = min(kSliverShare * a * b / twice_area, F(kSliverMost));
  return kPlaneError * (spread * (taxicab(p) + place_m) + (a + b) * (1 + sliver));
}
inline float plane_error_m(Vec3 p, Vec3 edge1, Vec3 edge2, float twice_area,
                           InstanceError instance = {}) noexcept {
  return plane_error_m(p, edge1, edge2, twice_area, instance.spread, instance.place_m);
}

/// Returns the step off a triangle towards rays that end there, which start at a distance.
template <typename F>
F plane_error_m(F error_m, F distance_m) noexcept {
  return error_m + kPlaneError * distance_m;
}

/// Moves p by error_m to the side of the surface that n_geometric (unit) points to.
template <typename V, typename F>
V offset_ray(V p, V n_geometric, F error_m) noexcept {
  return p + n_geometric * error_m;
}

/// Returns the origin of a ray that goes on behind the surface at p.
template <typename V, typename F>
V origin_behind(V p, V n_geometric, F error_m, V direction) noexcept {
  return offset_ray(p, n_geometric * select(dot(n_geometric, direction) >= F(0), F(1), F(-1)),
                    error_m);
}

}  // namespace core
