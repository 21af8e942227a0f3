/// SheenLobe: reflection of cloth on top of all other lobes (KHR_materials_sheen).
///
/// Scales the lobes below by the smaller of 1 - E(wo) and 1 - E(wi), as the extension specifies.
/// Sampled uniformly.
#pragma once

#include "core/bsdf/albedo_tables.h"
#include "core/bsdf/sheen.h"
#include "core/color/lane_color.h"
#include "core/sampling/warp.h"

namespace core {

template <typename F>
struct SheenLobeOf {
  using V = Vec3Of<F>;
  using Color = ColorOf<F>;
  Color color;
  F roughness;
  F strongest;  ///< largest channel
  F e_wo;       ///< albedo for wo

  /// layers: has the sheen_color and sheen_roughness of BsdfLayers.
  template <typename Layers>
  SheenLobeOf(const Layers& layers, V wo) noexcept
      : color(layers.sheen_color),
        roughness(layers.sheen_roughness),
        strongest(max_component(color)),
        e_wo(sheen_albedo(wo.z, roughness)) {}

  Color albedo() const noexcept { return color * e_wo; }
  /// Returns the scale of smooth lobes below, whose wi has the same cosine as wo.
  F open() const noexcept { return 1 - strongest * e_wo; }
  F over(V wi) const noexcept {
    return 1 - strongest * max(e_wo, sheen_albedo(abs(wi.z), roughness));
  }
  static V sample(Vec2Of<F> u) noexcept { return uniform_hemisphere(u); }
  /// Adds the lobe where prob > 0.
  template <typename Eval>
  void add(F prob, V wo, V wi, Eval& out) const noexcept {
    const MaskOf<F> there = (prob > 0) & (wi.z > 0);
    const Color value_cos = color * (sheen_brdf(wo, wi, roughness) * wi.z);
    out.value_cos = out.value_cos + select(there, value_cos, Color(F(0)));
    out.pdf_solid_angle = out.pdf_solid_angle + select(there, prob * (0.5F * kInvPi), F(0));
  }
};
using SheenLobe = SheenLobeOf<float>;

}  // namespace core
