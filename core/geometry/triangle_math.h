/// Points on a triangle, for one hit or SIMD lanes.
#pragma once

#include <array>
#include <cstddef>

#include "core/math/generic.h"
#include "core/math/offset_ray.h"

namespace core {

template <typename V>
using Corners = std::array<V, 3>;

/// Returns the barycentric weights of the ray's intersection with the triangle's plane, clamped to
/// the triangle. n: cross product of the edges, not normalised.
template <typename V>
V barycentrics(const Corners<V>& p, V n, V origin, V direction) noexcept {
  using F = decltype(n.x);
  const V q = cross(origin - p[0], direction);
  const F d = dot(n, direction);
  const auto clamped = [](F b) { return clamp01(select(b == b, b, F(0))); };
  // Moeller and Trumbore 1997, with the plane's normal shared by all three.
  F b1 = clamped(-dot(p[2] - p[0], q) / d);
  F b2 = clamped(dot(p[1] - p[0], q) / d);
  const F sum = b1 + b2;
  const auto outside = sum > 1;
  const auto grazing = d == 0;
  b1 = select(grazing, F(0), select(outside, b1 / sum, b1));
  b2 = select(grazing, F(0), select(outside, b2 / sum, b2));
  return {1 - b1 - b2, b1, b2};
}

/// Returns values of the corners, weighted by barycentric coordinates.
template <typename T, typename V>
T blend(const Corners<T>& values, V b) noexcept {
  return values[0] * b.x + values[1] * b.y + values[2] * b.z;
}

/// A hit on a triangle in world space.
template <typename F>
struct FaceOf {
  using V = Vec3Of<F>;
  Corners<V> p;
  V n;  ///< cross product of the edges
  V b;  ///< barycentric coordinates
  V position;
  V geometric;  ///< unit normal of the front (counter-clockwise)
  F twice_area;
  F error_m;  ///< step off the surface (core/math/offset_ray.h)
  F mirror;   ///< -1 in instances that mirror, else 1
};

/// spread, place_m: InstanceError.
template <typename F>
[[gnu::always_inline]] inline FaceOf<F> face_at(const Corners<Vec3Of<F>>& p, Vec3Of<F> origin,
                                                Vec3Of<F> direction, F mirror, F spread,
                                                F place_m) noexcept {
  FaceOf<F> out;
  out.p = p;
  const Vec3Of<F> edge1 = p[1] - p[0];
  const Vec3Of<F> edge2 = p[2] - p[0];
  out.n = cross(edge1, edge2);
  out.b = barycentrics(p, out.n, origin, direction);
  out.position = blend(p, out.b);
  out.twice_area = length(out.n);
  out.mirror = mirror;
  out.geometric = select(out.twice_area > F(0), out.n * (mirror / out.twice_area), -direction);
  out.error_m = plane_error_m(out.position, edge1, edge2, out.twice_area, spread, place_m);
  return out;
}

/// Returns whether a point of the plane is on the triangle, more than margin_m from its edges. n:
/// as above.
template <typename V>
auto is_within(const Corners<V>& p, V n, V point, float margin_m) noexcept {
  using F = decltype(n.x);
  const F far = margin_m * length(n);
  const auto is_past = [&](const V& from, const V& to) {
    const V edge = to - from;
    return dot(point - from, cross(n, edge)) > far * length(edge);
  };
  MaskOf<F> out = is_past(p[0], p[1]);
  out = out & is_past(p[1], p[2]);
  return out & is_past(p[2], p[0]);
}

/// Returns the height above the triangle at b of a quadratic surface through the vertices,
/// perpendicular to their normals along the edges: half the sum over edges of b_i b_j (n_j - n_i) .
/// (p_j - p_i), which includes the sagitta of a sphere's chord. Concave edges do not count. side: 1
/// above the front, -1 above the back.
template <typename V, typename F>
F bulge(const Corners<V>& p, const Corners<V>& n, V b, F side) noexcept {
  const auto edge = [&](std::size_t i, std::size_t j) {
    return max(side * dot(n[j] - n[i], p[j] - p[i]), F(0));
  };
  return 0.5F * (b.x * b.y * edge(0, 1) + b.y * b.z * edge(1, 2) + b.z * b.x * edge(2, 0));
}

/// Returns a vector of a triangle after the triangle has moved.
inline Vec3 carried(Vec3 way, const Corners<Vec3>& from, const Corners<Vec3>& to) noexcept {
  const Vec3 e1 = from[1] - from[0];
  const Vec3 e2 = from[2] - from[0];
  const Vec3 n = cross(e1, e2);
  const float area_squared = dot(n, n);
  if (!(area_squared > 0)) {
    return way;
  }
  const Vec3 f1 = to[1] - to[0];
  const Vec3 f2 = to[2] - to[0];
  const Vec3 up = normalize_or(cross(f1, f2), Vec3{0, 0, 0}) * sqrt(area_squared);
  return (f1 * dot(way, cross(e2, n)) + f2 * dot(way, cross(n, e1)) + up * dot(way, n)) *
         (1 / area_squared);
}

/// Returns a shading normal visible to the viewer, rotated only as far as needed if it faces away.
template <typename V>
V facing(V n, V wo) noexcept {
  constexpr float kLeast = 1e-3F;
  const auto cos_o = dot(n, wo);
  const auto away = opposite(cos_o >= kLeast);
  return any(away) ? select(away, normalize_or(n + wo * (kLeast - cos_o), wo), n) : n;
}

/// Moves the origin of rays that leave a facet, and the plane of `horizon`, to the smooth surface
/// that its normals imply: the shadow terminator of core/materials/shade.h. may: where that is
/// allowed. bulge_m: as bulge(). normal: interpolated. geometric: of the front. side: 1 where the
/// front is seen, else -1.
template <typename F>
[[gnu::always_inline]] inline void leave_bulge(MaskOf<F> may, F bulge_m, Vec3Of<F> normal,
                                               Vec3Of<F> geometric, F side, Vec3Of<F> wo,
                                               Vec3Of<F>& horizon, Vec3Of<F>& origin) noexcept {
  const MaskOf<F> on = may & (bulge_m > F(0)) & (dot(normal, geometric) > F(0));
  if (any(on)) {
    horizon = select(on, facing(normal * side, wo), horizon);
    origin = select(on, origin + normal * (side * bulge_m), origin);
  }
}

/// Finds the axes that express a displacement d on a triangle in its edges: dot(d, to_edge1) edges
/// from vertex 0 to 1 plus dot(d, to_edge2) edges from 0 to 2. Zero on triangles without area.
template <typename F>
[[gnu::always_inline]] inline void find_edge_ways(const FaceOf<F>& face, Vec3Of<F>& to_edge1,
                                                  Vec3Of<F>& to_edge2) noexcept {
  const F scale = select(face.twice_area > F(0), 1 / (face.twice_area * face.twice_area), F(0));
  to_edge1 = cross(face.p[2] - face.p[0], face.n) * scale;
  to_edge2 = cross(face.n, face.p[1] - face.p[0]) * scale;
}

}  // namespace core
