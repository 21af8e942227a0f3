/// Facets: the microfacet distribution that the GGX lobes of a surface share, for one direction wo.
#pragma once

#include "core/bsdf/bsdf_types.h"
#include "core/bsdf/ggx.h"
#include "core/math/vec.h"

namespace core {

struct Facets {
  Vec3 wo;  ///< local, z > 0
  Ggx ggx;
  float roughness = 1;     ///< perceptual; that of an isotropic lobe with the same albedo
  bool is_smooth = false;  ///< the lobes are delta

  Vec3 half(Vec3 wi) const noexcept { return normalize_or(wo + wi, {0, 0, 1}); }
  /// Returns D divided by the Jacobian of reflection at h.
  float reflected(Vec3 h) const noexcept { return ggx.d(h) / (4 * wo.z); }
  /// Reflects wo at a sampled visible facet.
  Vec3 sample_reflected(Vec2 u) const noexcept {
    const Vec3 h = ggx.sample_visible(wo, u);
    return h * (2 * dot(wo, h)) - wo;
  }
};

}  // namespace core
