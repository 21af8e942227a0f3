/// DiffuseLobe: the distribution of Lambertian reflection, or of diffuse transmission if turned
/// over.
///
/// BsdfOf adds the multiple scattering of other lobes to the value, because it has the same
/// distribution.
#pragma once

#include "core/sampling/warp.h"

namespace core {

template <typename F>
struct DiffuseLobeOf {
  MaskOf<F> is_even{};  ///< sampled uniformly, because most of it is at grazing angles

  /// mu: cosine of wi on its side.
  F pdf_solid_angle(F mu) const noexcept { return select(is_even, F(0.5F * kInvPi), mu * kInvPi); }
  /// Samples a direction with z > 0, up to rounding.
  Vec3Of<F> sample(Vec2Of<F> u) const noexcept {
    const Vec3Of<F> cosine = cosine_hemisphere(u);
    return any(is_even) ? select(is_even, uniform_hemisphere(u), cosine) : cosine;
  }
};
using DiffuseLobe = DiffuseLobeOf<float>;

}  // namespace core
