/// ClearcoatLobe: a GGX lobe with F0 0.04 and its own normal (KHR_materials_clearcoat).
///
/// Attenuates diffuse lobes below it by (1 - E(wo)) (1 - E(wi)) / (1 - E_avg), and specular ones by
/// the smaller of 1 - E(wo) and 1 - E(wi); both are reciprocal. Where an Interface attenuates a
/// diffuse lobe too, with I in place of E, the lobe is scaled by diffuse_scale(): E and I both rise
/// to grazing angles, so that (1 - E) (1 - I) has a larger mean than the product of their means.
#pragma once

#include "core/bsdf/albedo_tables.h"
#include "core/bsdf/anisotropic_albedo.h"
#include "core/bsdf/facets.h"
#include "core/bsdf/fresnel.h"
#include "core/bsdf/interface.h"
#include "core/math/frame.h"

namespace core {

/// Returns AlbedoTables::under_coat between its nodes.
template <typename F>
AlbedoOf<F> covariance_under_coat(F coat_roughness, F roughness) noexcept {
  constexpr int kNodes[] = {kAlbedoNodes, kAlbedoNodes};
  const albedo_detail::Between<F> at[] = {{coat_roughness, kNodes[0]}, {roughness, kNodes[1]}};
  return albedo_detail::value_at(&kAlbedoTables.under_coat[0][0], at, kNodes, 0);
}

template <typename F>
struct ClearcoatLobeOf {
  using V = Vec3Of<F>;
  F weight;
  FrameOf<F> frame;    ///< around its normal
  FacetsOf<F> facets;  ///< in that frame
  F e_wo;              ///< albedo for wo, weighted
  F e_average;

  /// layers: has the clearcoat, clearcoat_roughness and clearcoat_normal of BsdfLayers.
  template <typename Layers>
  ClearcoatLobeOf(const Layers& layers, V wo, float smooth_alpha) noexcept
      : weight(layers.clearcoat), frame(frame_from_normal(layers.clearcoat_normal)) {
    const F roughness = layers.clearcoat_roughness;
    const F alpha = max(square(roughness), F(1e-4F));
    V o = frame.to_local(wo);
    o.z = max(o.z, F(1e-3F));
    facets = {o, {alpha, alpha}, roughness, alpha < smooth_alpha};
    e_wo = weighted(specular_albedo(o.z, roughness));
    e_average = weighted(specular_albedo_average(roughness));
  }

  F weighted(AlbedoOf<F> a) const noexcept { return weight * coat_albedo(a); }
  /// Returns the reflectance of a facet.
  F fresnel(F cos_oh) const noexcept { return weight * fresnel_schlick(F(kCoatF0), F(1), cos_oh); }

  /// Returns (1 - E_avg) (1 - I_avg) / mean[(1 - E) (1 - I)], exactly 1 without a coat or an
  /// interface. below, roughness: the interface, and its perceptual roughness; the coat's normal is
  /// taken as the surface's.
  F diffuse_scale(const InterfaceOf<F>& below, F roughness) const noexcept {
    const F bare = scale_without_film(below, roughness);
    return below.film.exists ? select((weight > 0) & (below.film.weight > 0),
                                      scale_over_film(below, roughness), bare)
                             : bare;
  }

  struct Passed {
    F diffuse;
    F glossy;
  };
  /// Returns the fractions of diffuse and glossy lobes below that pass between wo and wi, which may
  /// be on either side.
  Passed passed(V wi) const noexcept {
    const F mu = dot(wi, frame.n);
    const F e_wi =
        weighted(specular_albedo(max(select(wi.z > 0, mu, -mu), F(1e-3F)), facets.roughness));
    return {(1 - e_wo) * (1 - e_wi) / (1 - e_average), 1 - max(e_wo, e_wi)};
  }

  /// Adds the lobe unless it is smooth; wi: in the frame of the surface.
  template <typename Eval>
  void add(F prob, V wi, Eval& out) const noexcept {
    const V i = frame.to_local(wi);
    const V h = facets.half(i);
    const auto reflection = facets.reflection(prob, i, h);
    const MaskOf<F> above = (wi.z > 0) & (i.z > 0);
    const F value_cos = fresnel(dot(facets.wo, h)) * reflection.value_cos;
    out.value_cos = out.value_cos + ColorOf<F>(select(above, value_cos, F(0)));
    out.pdf_solid_angle = out.pdf_solid_angle + select(above, reflection.pdf_solid_angle, F(0));
  }
  /// Samples a direction; below the surface if the path is absorbed.
  V sample(Vec2Of<F> u) const noexcept {
    const V i = facets.sample_reflected(u);
    return select(i.z > 0, normalize_or(frame.to_world(i), V{0, 0, 1}), V{0, 0, -1});
  }

 private:
  F scale_without_film(const InterfaceOf<F>& below, F roughness) const noexcept {
    // I = multiple + (f0 - multiple) e + (f90 - f0) e5, and the mean of a product is the product of
    // the means plus the covariance.
    const AlbedoOf<F> c = covariance_under_coat(facets.roughness, roughness);
    const F covariance =
        weight * ((below.f0 - below.multiple) * c.e + (below.f90 - below.f0) * c.e5);
    const F open = (1 - e_average) * (1 - below.albedo(specular_albedo_average(roughness)));
    return 1 / (1 + covariance / max(open, F(1e-4F)));
  }
  /// A film's albedo is no sum of e and e5. Never inlined, as the film's albedo is not.
  [[gnu::noinline]] F scale_over_film(const InterfaceOf<F>& below, F roughness) const noexcept {
    const F open = hemispherical_mean<F>([&](F mu) {
      const F passed = 1 - weighted(specular_albedo(mu, facets.roughness));
      return passed * (1 - below.albedo(mu, specular_albedo(mu, roughness)));
    });
    return (1 - e_average) / max(below.norm * open, F(1e-4F));
  }
};
using ClearcoatLobe = ClearcoatLobeOf<float>;

}  // namespace core
