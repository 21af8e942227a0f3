/// ThinLobe: transmission through a thin wall, distributed as the reflection of its facets. A facet
/// transmits 1 - F.
///
/// Multiple scattering between facets leaves diffusely on the other side.
#pragma once

#include "core/bsdf/cover.h"
#include "core/bsdf/facets.h"

namespace core {

struct ThinLobe {
  Rgb color;     ///< weighted
  Rgb multiple;  ///< multiple scattering, over 1 - E(wi) [1/sr]

  /// Adds the lobe; wi.z < 0.
  void add(const Facets& s, const Cover& cover, float prob, Vec3 wi, BsdfEval& out) const noexcept {
    if (s.is_smooth) {
      return;
    }
    const Vec3 flipped = {wi.x, wi.y, -wi.z};
    const Vec3 h = s.half(flipped);
    const float lambda_o = s.ggx.lambda(s.wo);
    const float common = s.reflected(h);
    const float open = 1 - cover.fresnel(dot(s.wo, h));
    out.value_cos += color * (open * common / (1 + lambda_o + s.ggx.lambda(flipped)));
    out.pdf_solid_angle += prob * common / (1 + lambda_o);
  }
  bool sample(const Facets& s, const Cover& cover, LobeShare share, Vec2 u,
              BsdfSample& out) const noexcept {
    if (s.is_smooth) {
      out.wi_local = -s.wo;
      out.weight = color * (cover.open_wo * share.open / share.prob);
      out.is_delta = true;
      out.is_straight = true;
      return true;
    }
    const Vec3 reflected = s.sample_reflected(u);
    out.wi_local = {reflected.x, reflected.y, -reflected.z};
    return reflected.z > 0;
  }
};

}  // namespace core
