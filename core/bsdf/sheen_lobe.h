/// SheenLobe: reflection of cloth on top of all other lobes (KHR_materials_sheen).
///
/// Scales the lobes below by the smaller of 1 - E(wo) and 1 - E(wi), as the extension specifies.
/// Sampled uniformly.
#pragma once

#include <algorithm>

#include "core/bsdf/albedo_tables.h"
#include "core/bsdf/bsdf_types.h"
#include "core/bsdf/sheen.h"
#include "core/sampling/warp.h"

namespace core {

struct SheenLobe {
  Rgb color;
  float roughness = 0;
  float strongest = 0;  ///< largest channel
  float e_wo = 0;       ///< albedo for wo

  SheenLobe(const BsdfLayers& layers, Vec3 wo) noexcept
      : color(layers.sheen_color),
        roughness(layers.sheen_roughness),
        strongest(max_component(color)),
        e_wo(sheen_albedo(wo.z, roughness)) {}

  /// Returns the scale of smooth lobes below, whose wi has the same cosine as wo.
  float open() const noexcept { return 1 - strongest * e_wo; }
  float over(Vec3 wi) const noexcept {
    return 1 - strongest * std::max(e_wo, sheen_albedo(std::fabs(wi.z), roughness));
  }
  static Vec3 sample(Vec2 u) noexcept { return uniform_hemisphere(u); }
  /// Adds the lobe; wi.z > 0.
  void add(float prob, Vec3 wo, Vec3 wi, BsdfEval& out) const noexcept {
    out.value_cos += color * (sheen_brdf(wo, wi, roughness) * wi.z);
    out.pdf_solid_angle += prob * (0.5F * kInvPi);
  }
};

}  // namespace core
