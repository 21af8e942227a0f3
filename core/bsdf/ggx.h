/// The GGX microfacet distribution with height-correlated Smith shadowing, anisotropic.
///
/// Local frame, n = (0,0,1). alpha_x, alpha_y > 0. Sources: Walter et al. 2007; Heitz,
/// Understanding the Masking-Shadowing Function, JCGT 2014; sampling of visible normals by
/// spherical caps: Dupuy and Benyoub, 2023.
#pragma once

#include <cmath>

#include "core/math/numbers.h"
#include "core/math/vec.h"

namespace core {

struct Ggx {
  float alpha_x = 1;
  float alpha_y = 1;

  /// Returns the density of microfacet normals h [1/sr] over projected area.
  float d(Vec3 h) const noexcept {
    const float x = h.x / alpha_x;
    const float y = h.y / alpha_y;
    const float k = x * x + y * y + h.z * h.z;
    return 1 / (kPi * alpha_x * alpha_y * k * k);
  }

  float lambda(Vec3 w) const noexcept {
    const float z2 = w.z * w.z;
    const float a2 = square(alpha_x * w.x) + square(alpha_y * w.y);
    return z2 > 0 ? 0.5F * (std::sqrt(1 + a2 / z2) - 1) : 1e18F;
  }
  float g1(Vec3 w) const noexcept { return 1 / (1 + lambda(w)); }
  float g2(Vec3 wo, Vec3 wi) const noexcept { return 1 / (1 + lambda(wo) + lambda(wi)); }

  /// Samples a microfacet normal visible from wo (wo.z > 0) with density g1(wo) * d(h) * dot(wo, h)
  /// / wo.z.
  Vec3 sample_visible(Vec3 wo, Vec2 u) const noexcept {
    const Vec3 stretched = normalize(Vec3{wo.x * alpha_x, wo.y * alpha_y, wo.z});
    const float phi = kTwoPi * u.x;
    const float z = (1 - u.y) * (1 + stretched.z) - stretched.z;
    const float r = safe_sqrt(1 - z * z);
    const Vec3 cap = {r * std::cos(phi), r * std::sin(phi), z};
    const Vec3 half = cap + stretched;
    return normalize_or({half.x * alpha_x, half.y * alpha_y, half.z}, {0, 0, 1});
  }
  float pdf_visible_solid_angle(Vec3 wo, Vec3 h) const noexcept {
    const float cos_oh = dot(wo, h);
    return cos_oh > 0 && h.z > 0 ? g1(wo) * d(h) * cos_oh / wo.z : 0.0F;
  }
};

}  // namespace core
