/// Fresnel reflectance: exact for dielectrics, Schlick's approximation for glTF's F0 and F90.
#pragma once

#include <type_traits>

#include "core/color/lane_color.h"

namespace core {

/// Returns the unpolarised reflectance of a smooth dielectric boundary. cos_i in [0,1] on the
/// incident side; eta = n_transmitted / n_incident > 0. 1 under total internal reflection. Source:
/// PBR 4th ed. 9.3.5.
template <typename F>
F fresnel_dielectric(std::type_identity_t<F> cos_i, F eta) noexcept {
  const F sin2_t = (1 - cos_i * cos_i) / (eta * eta);
  const F cos_t = safe_sqrt(1 - sin2_t);
  const F parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
  const F perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
  return select(sin2_t >= 1, F(1), 0.5F * (parallel * parallel + perpendicular * perpendicular));
}

/// (1 - cos)^5
template <typename F>
F schlick_weight(F cos_i) noexcept {
  const F m = clamp01(1 - cos_i);
  const F m2 = m * m;
  return m2 * m2 * m;
}

/// Source: glTF 2.0 specification, appendix B.3.4, with f90 of KHR_materials_specular.
template <typename Color, typename F>
Color fresnel_schlick(Color f0, F f90, F cos_i) noexcept {
  const F w = schlick_weight(cos_i);
  return f0 * (1 - w) + Color(f90 * w);
}

}  // namespace core
