/// DiffuseLobe: Lambertian reflection, or diffuse transmission if turned over, under an Interface.
///
/// Bsdf adds the multiple scattering of other lobes to f(), because it has the same distribution.
#pragma once

#include "core/bsdf/interface.h"
#include "core/sampling/warp.h"

namespace core {

struct DiffuseLobe {
  Rgb albedo;            ///< weighted
  bool is_even = false;  ///< sampled uniformly, because most of it is at grazing angles

  /// Returns the BSDF under an interface; mu: cosine of wi on its side, e: the interface's albedo
  /// there.
  Rgb f_under(float mu, const Interface& interface, SpecularAlbedo e) const noexcept {
    return f() * interface.coupling(mu, e);
  }
  Rgb f() const noexcept { return albedo * kInvPi; }
  float pdf_solid_angle(float mu) const noexcept {
    return is_even ? 0.5F * kInvPi : cosine_hemisphere_pdf_solid_angle(mu);
  }
  /// Samples a direction with z > 0, up to rounding.
  Vec3 sample(Vec2 u) const noexcept {
    return is_even ? uniform_hemisphere(u) : cosine_hemisphere(u);
  }
};

}  // namespace core
