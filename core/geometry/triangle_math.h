/// Points on a triangle, for one hit or SIMD lanes.
#pragma once

#include <array>
#include <cstddef>

#include "core/math/generic.h"

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

template <typename V>
V blend(const Corners<V>& p, V b) noexcept {
  return p[0] * b.x + p[1] * b.y + p[2] * b.z;
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

}  // namespace core
