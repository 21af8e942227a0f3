/// DiffuseLobe: Lambert's reflection, and turned over, diffuse transmission, under a cover.
///
/// Multiple scattering between the facets of other lobes takes the same directions: Bsdf adds it
/// to f().
#pragma once

#include "core/bsdf/cover.h"
#include "core/sampling/warp.h"

namespace core {

struct DiffuseLobe {
  Rgb albedo;            ///< weighted
  bool is_even = false;  ///< sampled uniformly: most of it is at grazing angles

  /// The BSDF where a cover lies above; mu: cosine of wi on its side, e: the cover's albedo there.
  Rgb f_covered(float mu, const Cover& cover, SpecularAlbedo e) const noexcept {
    return f() * cover.coupling(mu, e);
  }
  Rgb f() const noexcept { return albedo * kInvPi; }
  float pdf_solid_angle(float mu) const noexcept {
    return is_even ? 0.5F * kInvPi : cosine_hemisphere_pdf_solid_angle(mu);
  }
  /// z > 0 but for rounding.
  Vec3 sample(Vec2 u) const noexcept {
    return is_even ? uniform_hemisphere(u) : cosine_hemisphere(u);
  }
};

}  // namespace core
