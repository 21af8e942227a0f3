/// Importance of light tree nodes at points, in SIMD lanes: several nodes at one point during
/// descent, or one node at several points.
///
/// Source: PBR 4th ed. 12.6.3.
#pragma once

#include <limits>

#include "core/math/lane_math.h"

namespace core {

template <std::size_t N>
struct LightNodes {
  Vec3s<N> center;
  Vec3s<N> half;  ///< half diagonal
  Floats<N> radius2;
  Vec3s<N> axis;
  Floats<N> axis_reach;
  Floats<N> power;
  Floats<N> cos_theta_o, sin_theta_o, cos_theta_e;
  Ints<N> sign;
};

namespace light_detail {

/// Returns the sine of an angle in [0, pi] from its cosine, or the cosine of an angle in [0, pi/2]
/// from its sine.
template <std::size_t N>
Floats<N> other(Floats<N> c) {
  return safe_sqrt(Floats<N>(1) - c * c);
}
/// cos(max(0, a - b)) from sines and cosines.
template <std::size_t N>
Floats<N> cos_sub_clamped(Floats<N> sin_a, Floats<N> cos_a, Floats<N> sin_b, Floats<N> cos_b) {
  return select(cos_a > cos_b, Floats<N>(1), cos_a * cos_b + sin_a * sin_b);
}

}  // namespace light_detail

/// Returns the importance; 0 if no light can arrive. normal: zero if light may come from anywhere.
template <std::size_t N>
Floats<N> light_importance(const LightNodes<N>& node, Vec3s<N> point, Vec3s<N> normal) {
  using light_detail::cos_sub_clamped;
  using light_detail::other;
  const Floats<N> zero(0);
  const Floats<N> one(1);
  const Vec3s<N> d = point - node.center;
  const Floats<N> distance2 = dot(d, d);
  // At distance 0 the vector is zero too, and so is its product with any factor.
  const Floats<N> inverse =
      one / sqrt(max(distance2, Floats<N>(std::numeric_limits<float>::min())));
  const Floats<N> along = dot(d, node.axis);
  // One-sided lights send no light to points behind them.
  Mask<N> none = along + node.axis_reach <= zero;

  const Mask<N> inside = distance2 <= node.radius2 * Floats<N>(1.0001F);
  const Floats<N> sin2_b = node.radius2 * inverse * inverse;
  const Floats<N> cos_b = select(inside, Floats<N>(-1), safe_sqrt(one - sin2_b));
  const Floats<N> sin_b = select(inside, zero, sqrt(sin2_b));

  const Floats<N> cos_w = floats_of(bits_of(along * inverse) & node.sign);
  const Floats<N> cos_x = cos_sub_clamped(other(cos_w), cos_w, node.sin_theta_o, node.cos_theta_o);
  const Floats<N> cos_p = cos_sub_clamped(other(cos_x), cos_x, sin_b, cos_b);
  none = none | (cos_p <= node.cos_theta_e);
  // With emission over the whole sphere (points) the cosine is unrelated to power.
  const Floats<N> cosine = select(node.cos_theta_e < Floats<N>(-0.99F), one, cos_p);
  const Floats<N> d2 = max(max(distance2, node.radius2), Floats<N>(1e-30F));
  Floats<N> value = node.power * cosine / d2;
  const Mask<N> has_side = dot(normal, normal) > zero;
  if (has_side.any()) {
    // The bounding sphere of the box is conservative; a box wholly below the surface sends no
    // light.
    const Floats<N> height = dot(d, normal);
    const Floats<N> box = dot(node.half, Vec3s<N>(abs(normal.x), abs(normal.y), abs(normal.z)));
    none = none | (has_side & (height >= box));
    const Floats<N> cos_i = zero - height * inverse;
    const Floats<N> seen = max(cos_sub_clamped(other(cos_i), cos_i, sin_b, cos_b), zero);
    value = value * select(has_side, seen, one);
  }
  return select(none, zero, value);
}

}  // namespace core
