/// Triangles in lanes.
#pragma once

#include "core/geometry/triangle_math.h"

namespace core {

/// Loads a vector from each row, and the float after it.
template <std::size_t N>
Vec3s<N> gather(const float* const (&rows)[N], Floats<N>& behind) {
  Floats<N> columns[4];
  transpose(rows, columns);
  behind = columns[3];
  return {columns[0], columns[1], columns[2]};
}

inline constexpr float kNothing[16] = {};  ///< row for inactive lanes

/// The lanes' hits on their triangles: position, normal, error and material.
template <std::size_t N>
struct FaceLanes {
  Corners<Vec3s<N>> p;
  Vec3s<N> n;  ///< cross product of the edges
  Vec3s<N> b;  ///< barycentric coordinates
  Vec3s<N> position;
  Vec3s<N> geometric;  ///< normal
  Floats<N> twice_area, error_m, mirror;
};

/// The lanes' triangles at their hits.
template <std::size_t N>
struct TriangleLanes {
  Corners<Vec3s<N>> p;
  Vec3s<N> n;                   ///< cross product of the edges
  Vec3s<N> b;                   ///< barycentric coordinates
  Vec3s<N> geometric, shading;  ///< of the front side
  Floats<N> twice_area, side;
  Floats<N> mirror;
};

}  // namespace core
