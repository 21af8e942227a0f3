/// Sheen: the Charlie distribution with its shadowing term, and tabulated albedos.
///
/// Sources: Estevez and Kulla, Production Friendly Microfacet Sheen BRDF, 2017;
/// KHR_materials_sheen.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/math/numbers.h"
#include "core/math/vec.h"

namespace core {

namespace sheen_detail {

inline float curve(float x, float alpha) noexcept {
  const float t = square(1 - alpha);
  const float a = lerp(21.5473F, 25.3245F, t);
  const float b = lerp(3.82987F, 3.32435F, t);
  const float c = lerp(0.19823F, 0.16801F, t);
  const float d = lerp(-1.97760F, -1.27393F, t);
  const float e = lerp(-4.32054F, -4.85967F, t);
  return a / (1 + b * std::pow(x, c)) + d * x + e;
}

inline float lambda(float cos_theta, float alpha) noexcept {
  return cos_theta < 0.5F ? std::exp(curve(cos_theta, alpha))
                          : std::exp(2 * curve(0.5F, alpha) - curve(1 - cos_theta, alpha));
}

}  // namespace sheen_detail

/// Returns f of a white sheen; wo.z, wi.z > 0; roughness is perceptual.
inline float sheen_brdf(Vec3 wo, Vec3 wi, float roughness) noexcept {
  const float alpha = std::max(roughness * roughness, 1e-3F);
  const Vec3 h = normalize_or(wo + wi, {0, 0, 1});
  const float sin_h = safe_sqrt(1 - h.z * h.z);
  const float d = (2 + 1 / alpha) * std::pow(sin_h, 1 / alpha) * (0.5F * kInvPi);
  const float shadow = 1 + sheen_detail::lambda(wo.z, alpha) + sheen_detail::lambda(wi.z, alpha);
  return d / (shadow * 4 * wo.z * wi.z);
}

}  // namespace core
