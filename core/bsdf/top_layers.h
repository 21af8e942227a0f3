/// TopLayers: clearcoat and, on top of it, sheen, over all other lobes of a surface.
#pragma once

#include "core/bsdf/clearcoat_lobe.h"
#include "core/bsdf/sheen_lobe.h"

namespace core {

template <typename F>
struct TopLayersOf {
  using V = Vec3Of<F>;
  using Color = ColorOf<F>;
  V wo;
  ClearcoatLobeOf<F> coat;
  SheenLobeOf<F> sheen;
  F open;         ///< fraction of smooth lobes below that passes both
  F coat_albedo;  ///< under the sheen
  bool has_coat;
  bool has_sheen;

  /// layers: as for the lobes; what is absent has weight 0.
  template <typename Layers>
  TopLayersOf(const Layers& layers, V view) noexcept
      : wo(view),
        coat(layers, view, kSmoothAlpha),
        sheen(layers, view),
        open((1 - coat.e_wo) * sheen.open()),
        coat_albedo(coat.e_wo * sheen.open()),
        has_coat(any(coat.weight > 0)),
        has_sheen(any(sheen.strongest > 0)) {}

  template <typename Layers>
  static MaskOf<F> exist(const Layers& layers) noexcept {
    return (layers.clearcoat > 0) | (max_component(layers.sheen_color) > 0);
  }
  /// Returns the probability of a rough coat, 0 of a smooth one; prob_coat: of either.
  F rough(F prob_coat) const noexcept { return select(coat.facets.is_smooth, F(0), prob_coat); }

  /// Returns the reflectance of a smooth coat about its normal for wo, seen through the sheen.
  F mirrored() const noexcept { return sheen.open() * coat.fresnel(coat.facets.wo.z); }

  /// The probabilities with which the layers are sampled.
  struct Probabilities {
    F sheen;
    F rough_coat;
  };
  /// Replaces the value in `out` by that of all lobes and adds the layers' density. diffuse,
  /// glossy: values of the lobes below, times the cosine. Never inlined: it could round differently
  /// in copies, and lanes must not depend on what their neighbours need.
  template <typename Eval>
  [[gnu::noinline]] void add(V wi, Color diffuse, Color glossy, Probabilities prob,
                             Eval& out) const noexcept {
    if (has_coat) {
      const auto passed = coat.passed(wi);
      out.value_cos = diffuse * passed.diffuse + glossy * passed.glossy;
      if (any(prob.rough_coat > 0)) {
        coat.add(prob.rough_coat, wi, out);
      }
    } else {
      out.value_cos = diffuse + glossy;
    }
    if (has_sheen) {
      out.value_cos = out.value_cos * sheen.over(wi);
      sheen.add(prob.sheen, wo, wi, out);
    }
  }
};
using TopLayers = TopLayersOf<float>;

}  // namespace core
