/// Sheen: the Charlie distribution with its shadowing term, and tabulated albedos.
///
/// Sources: Estevez and Kulla, Production Friendly Microfacet Sheen BRDF, 2017;
/// KHR_materials_sheen.
#pragma once

#include "core/math/generic.h"

namespace core {

namespace sheen_detail {

template <typename F>
F curve(F x, F alpha) noexcept {
  const F t = square(1 - alpha);
  const auto at_t = [t](float from, float to) { return from + (to - from) * t; };
  const F a = at_t(21.5473F, 25.3245F);
  const F b = at_t(3.82987F, 3.32435F);
  const F c = at_t(0.19823F, 0.16801F);
  const F d = at_t(-1.97760F, -1.27393F);
  const F e = at_t(-4.32054F, -4.85967F);
  return a / (1 + b * pow(x, c)) + d * x + e;
}

template <typename F>
F lambda(F cos_theta, F alpha) noexcept {
  const MaskOf<F> low = cos_theta < 0.5F;
  F exponent = curve(select(low, cos_theta, 1 - cos_theta), alpha);
  if (!all(low)) {
    exponent = select(low, exponent, 2 * curve(F(0.5F), alpha) - exponent);
  }
  return exp(exponent);
}

}  // namespace sheen_detail

/// Returns f of a white sheen; wo.z, wi.z > 0; roughness is perceptual.
template <typename F>
F sheen_brdf(Vec3Of<F> wo, Vec3Of<F> wi, F roughness) noexcept {
  const F alpha = max(roughness * roughness, F(1e-3F));
  const auto h = normalize_or(wo + wi, Vec3Of<F>{0, 0, 1});
  const F sin_h = safe_sqrt(1 - h.z * h.z);
  const F d = (2 + 1 / alpha) * pow(sin_h, 1 / alpha) * (0.5F * kInvPi);
  const F shadow = 1 + sheen_detail::lambda(wo.z, alpha) + sheen_detail::lambda(wi.z, alpha);
  return d / (shadow * 4 * wo.z * wi.z);
}

}  // namespace core
