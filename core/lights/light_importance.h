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
  Vec3s<N> half;     ///< half diagonal
  Floats<N> radius;  ///< of the half diagonal
  Vec3s<N> axis;
  Floats<N> axis_reach;
  Floats<N> power;
  Floats<N> cos_theta_o, sin_theta_o, cos_theta_e;
  Ints<N> sign;
};

namespace light_detail {

/// An angle in [0, pi] by its sine and cosine.
template <std::size_t N>
struct Angle {
  Floats<N> sine, cosine;

  /// max(0, a - b)
  friend Angle operator-(const Angle& a, const Angle& b) {
    const Mask<N> is_none = a.cosine > b.cosine;
    return {select(is_none, Floats<N>(0), a.sine * b.cosine - a.cosine * b.sine),
            select(is_none, Floats<N>(1), a.cosine * b.cosine + a.sine * b.sine)};
  }
};
template <std::size_t N>
Angle<N> from_cosine(Floats<N> c) {
  return {safe_sqrt(Floats<N>(1) - c * c), c};
}

}  // namespace light_detail

/// Returns the importance; 0 if no light can arrive. normal: zero if light may come from anywhere.
template <std::size_t N>
Floats<N> light_importance(const LightNodes<N>& node, Vec3s<N> point, Vec3s<N> normal) {
  using light_detail::Angle;
  using light_detail::from_cosine;
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

  const Floats<N> radius2 = node.radius * node.radius;
  const Mask<N> inside = distance2 <= radius2 * Floats<N>(1.0001F);
  const Floats<N> sine = node.radius * inverse;
  const Angle<N> box_angle = {select(inside, zero, sine),
                              select(inside, Floats<N>(-1), safe_sqrt(one - sine * sine))};

  const Floats<N> cos_w = floats_of(bits_of(along * inverse) & node.sign);
  const Angle<N> cone = {node.sin_theta_o, node.cos_theta_o};
  const Floats<N> cos_p = (from_cosine(cos_w) - cone - box_angle).cosine;
  none = none | (cos_p <= node.cos_theta_e);
  // With emission over the whole sphere (points) the cosine is unrelated to power.
  const Floats<N> cosine = select(node.cos_theta_e < Floats<N>(-0.99F), one, cos_p);
  const Floats<N> d2 = max(max(distance2, radius2), Floats<N>(1e-30F));
  Floats<N> value = node.power * cosine / d2;
  const Mask<N> has_side = dot(normal, normal) > zero;
  if (has_side.any()) {
    // The bounding sphere of the box is conservative; a box wholly below the surface sends no
    // light.
    const Floats<N> height = dot(d, normal);
    const Floats<N> reach = dot(node.half, Vec3s<N>(abs(normal.x), abs(normal.y), abs(normal.z)));
    none = none | (has_side & (height >= reach));
    const Floats<N> seen = (from_cosine(zero - height * inverse) - box_angle).cosine;
    value = value * select(has_side, max(seen, zero), one);
  }
  return select(none, zero, value);
}

}  // namespace core
