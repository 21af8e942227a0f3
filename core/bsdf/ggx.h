/// The GGX microfacet distribution with height-correlated Smith shadowing, anisotropic.
///
/// Local frame, n = (0,0,1). alpha_x, alpha_y > 0. Sources: Walter et al. 2007; Heitz,
/// Understanding the Masking-Shadowing Function, JCGT 2014; sampling of visible normals by
/// spherical caps: Dupuy and Benyoub, 2023.
#pragma once

#include "core/math/generic.h"

namespace core {

template <typename F>
struct GgxOf {
  using V = Vec3Of<F>;
  F alpha_x;
  F alpha_y;

  /// Returns the density of microfacet normals h [1/sr] over projected area.
  F d(V h) const noexcept {
    const F x = h.x / alpha_x;
    const F y = h.y / alpha_y;
    const F k = x * x + y * y + h.z * h.z;
    return 1 / (kPi * alpha_x * alpha_y * k * k);
  }

  F lambda(V w) const noexcept {
    const F z2 = w.z * w.z;
    const F a2 = square(alpha_x * w.x) + square(alpha_y * w.y);
    return select(z2 > 0, 0.5F * (sqrt(1 + a2 / z2) - 1), F(1e18F));
  }
  F g1(V w) const noexcept { return 1 / (1 + lambda(w)); }
  F g2(V wo, V wi) const noexcept { return 1 / (1 + lambda(wo) + lambda(wi)); }

  /// Samples a microfacet normal visible from wo (wo.z > 0) with density g1(wo) * d(h) * dot(wo, h)
  /// / wo.z.
  V sample_visible(V wo, Vec2Of<F> u) const noexcept {
    const V stretched = normalize(V{wo.x * alpha_x, wo.y * alpha_y, wo.z});
    F sine;
    F cosine;
    sincos(kTwoPi * u.x, sine, cosine);
    const F z = (1 - u.y) * (1 + stretched.z) - stretched.z;
    const F r = safe_sqrt(1 - z * z);
    const V half = V{r * cosine, r * sine, z} + stretched;
    return normalize_or(V{half.x * alpha_x, half.y * alpha_y, half.z}, V{0, 0, 1});
  }
};
using Ggx = GgxOf<float>;

}  // namespace core
