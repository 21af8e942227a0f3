/// Frame: an orthonormal basis; local n = (0,0,1).
#pragma once

#include <cmath>

#include "core/math/generic.h"

namespace core {

template <typename F>
struct FrameOf {
  using V = Vec3Of<F>;
  V s = {1, 0, 0};
  V t = {0, 1, 0};
  V n = {0, 0, 1};

  constexpr V to_world(V v) const noexcept { return s * v.x + t * v.y + n * v.z; }
  constexpr V to_local(V v) const noexcept { return {dot(v, s), dot(v, t), dot(v, n)}; }
};
using Frame = FrameOf<float>;

/// Returns a basis around the unit vector n. Source: Duff et al., Building an Orthonormal Basis,
/// Revisited, JCGT 2017.
template <typename V = Vec3>
auto frame_from_normal(V n) noexcept {
  using F = decltype(n.x);
  const F sign = sign_of(n.z);
  const F a = -1.0F / (sign + n.z);
  const F b = n.x * n.y * a;
  return FrameOf<F>{
      {1 + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
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
