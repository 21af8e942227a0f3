/// Triangles in lanes, equivalent to the scalar code in core/scene/surface_point.cpp and
/// core/materials/shade.cpp.
#pragma once

#include <array>

#include "core/math/lane_math.h"

namespace core {

/// Makes the shading normal face the viewer, as in core/materials/shade.cpp.
template <std::size_t N>
Vec3s<N> facing(Vec3s<N> n, Vec3s<N> wo) {
  const Floats<N> least(1e-3F);
  const Floats<N> cos_o = dot(n, wo);
  const Mask<N> away = ~(cos_o >= least);
  return away.any() ? select(away, normalize_or(n + wo * (least - cos_o), wo), n) : n;
}

template <std::size_t N>
using Corners = std::array<Vec3s<N>, 3>;

/// As in core/scene/surface_point.cpp.
template <std::size_t N>
Vec3s<N> barycentrics(const Corners<N>& p, Vec3s<N> n, const SegmentLanes<N>& ray) {
  const Floats<N> zero(0);
  const Vec3s<N> q = cross(ray.origin - p[0], ray.direction);
  const Floats<N> d = dot(n, ray.direction);
  const auto clamped = [&](Floats<N> b) { return clamp01(select(b == b, b, zero)); };
  Floats<N> b1 = clamped(-dot(p[2] - p[0], q) / d);
  Floats<N> b2 = clamped(dot(p[1] - p[0], q) / d);
  const Floats<N> sum = b1 + b2;
  const Mask<N> outside = sum > Floats<N>(1);
  b1 = select(outside, b1 / sum, b1);
  b2 = select(outside, b2 / sum, b2);
  const Mask<N> grazing = d == zero;
  b1 = select(grazing, zero, b1);
  b2 = select(grazing, zero, b2);
  return {Floats<N>(1) - b1 - b2, b1, b2};
}

template <std::size_t N>
Vec3s<N> blend(const Corners<N>& p, Vec3s<N> b) {
  return p[0] * b.x + p[1] * b.y + p[2] * b.z;
}

/// As in core/scene/surface_point.cpp.
template <std::size_t N>
Floats<N> bulge(const Corners<N>& p, const Corners<N>& n, Vec3s<N> b, Floats<N> side) {
  const auto edge = [&](std::size_t i, std::size_t j) {
    return max(side * dot(n[j] - n[i], p[j] - p[i]), Floats<N>(0));
  };
  return Floats<N>(0.5F) *
         (b.x * b.y * edge(0, 1) + b.y * b.z * edge(1, 2) + b.z * b.x * edge(2, 0));
}

/// Loads a vector from each row, and the float after it.
template <std::size_t N>
Vec3s<N> gather(const float* const (&rows)[N], Floats<N>& behind) {
  Floats<N> columns[4];
  transpose(rows, columns);
  behind = columns[3];
  return {columns[0], columns[1], columns[2]};
}

inline constexpr float kNothing[16] = {};  ///< row for inactive lanes

/// The lanes' triangles at their hits.
template <std::size_t N>
struct TriangleLanes {
  Corners<N> p;
  Vec3s<N> n;                   ///< cross product of the edges
  Vec3s<N> b;                   ///< barycentric coordinates
  Vec3s<N> geometric, shading;  ///< of the front side
  Floats<N> twice_area, side;
  Floats<N> mirror;
};

}  // namespace core
