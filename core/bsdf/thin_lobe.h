/// ThinLobe: light through a thin wall, spread as its facets reflect. A facet passes 1 - F.
///
/// Light that meets further facets leaves diffusely on the other side.
#pragma once

#include "core/bsdf/cover.h"
#include "core/bsdf/facets.h"

namespace core {

struct ThinLobe {
  Rgb color;     ///< weighted
  Rgb multiple;  ///< of light that meets further facets, over 1 - E(wi) [1/sr]

  /// wi.z < 0.
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
