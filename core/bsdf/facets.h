/// Facets: the microfacet distribution that the GGX lobes of a surface share, for one direction wo.
#pragma once

#include "core/bsdf/bsdf_types.h"
#include "core/bsdf/ggx.h"

namespace core {

/// Lobes below this GGX width are treated as mirrors: narrower ones exceed float precision.
inline constexpr float kSmoothAlpha = 5e-4F;

template <typename F>
struct FacetsOf {
  using V = Vec3Of<F>;
  V wo;  ///< local, z > 0
  GgxOf<F> ggx;
  F roughness;          ///< perceptual; that of an isotropic lobe with the same albedo
  MaskOf<F> is_smooth;  ///< the lobes are delta
  F lambda_o;           ///< of ggx at wo

  FacetsOf() = default;
  FacetsOf(V view, GgxOf<F> distribution, F perceptual_roughness, MaskOf<F> smooth) noexcept
      : wo(view),
        ggx(distribution),
        roughness(perceptual_roughness),
        is_smooth(smooth),
        lambda_o(ggx.lambda(wo)) {}

  V half(V wi) const noexcept { return normalize_or(wo + wi, V{0, 0, 1}); }
  /// Returns D divided by the Jacobian of reflection at h.
  F reflected(V h) const noexcept { return ggx.d(h) / (4 * wo.z); }

  struct Reflection {
    F value_cos;        ///< of facets that reflect everything: D G2 / (4 cos_o) [1/sr]
    F pdf_solid_angle;  ///< times prob
  };
  /// Returns reflection to wi, above the surface, at h = half(wi); 0 where smooth.
  Reflection reflection(F prob, V wi, V h) const noexcept {
    const F common = select(is_smooth, F(0), reflected(h));
    const F g2 = 1 / (1 + lambda_o + ggx.lambda(wi));
    return {common * g2, prob * common / (1 + lambda_o)};
  }
  /// Reflects wo at a sampled visible facet; where smooth, at the surface.
  V sample_reflected(Vec2Of<F> u) const noexcept {
    V h = {0, 0, 1};
    if (!all(is_smooth)) {
      h = select(is_smooth, h, ggx.sample_visible(wo, u));
    }
    return h * (2 * dot(wo, h)) - wo;
  }
};
using Facets = FacetsOf<float>;

}  // namespace core
