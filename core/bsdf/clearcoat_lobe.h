/// ClearcoatLobe: a GGX lobe with F0 0.04 and its own normal (KHR_materials_clearcoat).
///
/// Attenuates diffuse lobes below it by (1 - E(wo)) (1 - E(wi)) / (1 - E_avg), and specular ones by
/// the smaller of 1 - E(wo) and 1 - E(wi); both are reciprocal.
#pragma once

#include <algorithm>

#include "core/bsdf/albedo_tables.h"
#include "core/bsdf/bsdf_types.h"
#include "core/bsdf/fresnel.h"
#include "core/bsdf/ggx.h"
#include "core/math/frame.h"

namespace core {

struct ClearcoatLobe {
  float weight = 0;
  float roughness = 0;
  Vec3 normal = {0, 0, 1};
  Ggx ggx;
  bool is_smooth = false;
  float e_wo = 0;  ///< albedo for wo, weighted
  float e_average = 0;

  ClearcoatLobe(const BsdfLayers& layers, Vec3 wo, float smooth_alpha) noexcept
      : weight(layers.clearcoat),
        roughness(layers.clearcoat_roughness),
        normal(layers.clearcoat_normal) {
    const float alpha = std::max(square(roughness), 1e-4F);
    ggx = {alpha, alpha};
    is_smooth = alpha < smooth_alpha;
    e_wo = weighted(specular_albedo(std::max(dot(wo, normal), 1e-3F), roughness));
    e_average = weighted(specular_albedo_average(roughness));
  }

  float weighted(SpecularAlbedo a) const noexcept { return weight * (0.04F * (a.e - a.e5) + a.e5); }
  /// Returns the albedo on wi's side.
  float albedo(Vec3 wi) const noexcept {
    const float mu = dot(wi, normal);
    return weighted(specular_albedo(std::max(wi.z > 0 ? mu : -mu, 1e-3F), roughness));
  }
  float over_diffuse(Vec3 wi) const noexcept {
    return (1 - e_wo) * (1 - albedo(wi)) / (1 - e_average);
  }
  float over_glossy(Vec3 wi) const noexcept { return 1 - std::max(e_wo, albedo(wi)); }

  /// Adds the lobe; wo, wi in the frame of the surface, wi.z > 0.
  void add(float prob, Vec3 wo, Vec3 wi, BsdfEval& out) const noexcept {
    if (is_smooth) {
      return;
    }
    const Frame frame = frame_from_normal(normal);
    const Vec3 i = frame.to_local(wi);
    const Vec3 o = facing(frame, wo);
    if (!(i.z > 0)) {
      return;
    }
    const Vec3 h = normalize_or(o + i, {0, 0, 1});
    const float lambda_o = ggx.lambda(o);
    const float common = ggx.d(h) / (4 * o.z);
    const float f = lerp(0.04F, 1.0F, schlick_weight(dot(o, h)));
    out.value_cos += Rgb(weight * f * common / (1 + lambda_o + ggx.lambda(i)));
    out.pdf_solid_angle += prob * common / (1 + lambda_o);
  }
  bool sample(LobeShare share, Vec3 wo, Vec2 u, BsdfSample& out) const noexcept {
    const Frame frame = frame_from_normal(normal);
    const Vec3 o = facing(frame, wo);
    const Vec3 h = is_smooth ? Vec3{0, 0, 1} : ggx.sample_visible(o, u);
    const Vec3 i = h * (2 * dot(o, h)) - o;
    if (is_smooth) {
      out.is_delta = true;
      out.weight = Rgb(share.open * weight * lerp(0.04F, 1.0F, schlick_weight(o.z)) / share.prob);
    }
    out.wi_local = normalize_or(frame.to_world(i), {0, 0, 1});
    return i.z > 0 && out.wi_local.z > 0;
  }

 private:
  static Vec3 facing(const Frame& frame, Vec3 wo) noexcept {
    Vec3 o = frame.to_local(wo);
    o.z = std::max(o.z, 1e-3F);
    return o;
  }
};

}  // namespace core
