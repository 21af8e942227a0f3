/// Frame: an orthonormal basis; local n = (0,0,1).
#pragma once

#include <cmath>

#include "core/math/vec.h"

namespace core {

struct Frame {
  Vec3 s = {1, 0, 0};
  Vec3 t = {0, 1, 0};
  Vec3 n = {0, 0, 1};

  constexpr Vec3 to_world(Vec3 v) const noexcept { return s * v.x + t * v.y + n * v.z; }
  constexpr Vec3 to_local(Vec3 v) const noexcept { return {dot(v, s), dot(v, t), dot(v, n)}; }
};

/// Returns a basis around the unit vector n. Source: Duff et al., Building an Orthonormal Basis,
/// Revisited, JCGT 2017.
inline Frame frame_from_normal(Vec3 n) noexcept {
  const float sign = std::copysign(1.0F, n.z);
  const float a = -1.0F / (sign + n.z);
  const float b = n.x * n.y * a;
  return {{1 + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
}

/// Returns a basis around the unit vector n whose s is the component of `tangent` orthogonal to n.
inline Frame frame_from_normal_tangent(Vec3 n, Vec3 tangent) noexcept {
  const Vec3 s = tangent - n * dot(n, tangent);
  const float squared = dot(s, s);
  if (!(squared > 1e-12F)) {
    return frame_from_normal(n);
  }
  const Vec3 unit = s * (1.0F / std::sqrt(squared));
  return {unit, cross(n, unit), n};
}

}  // namespace core
