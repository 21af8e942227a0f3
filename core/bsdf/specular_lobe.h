/// SpecularLobe: GGX reflection of metal and of the dielectric interface, with multiple scattering.
///
/// Multiple scattering between facets is diffuse (Kulla and Conty 2017).
#pragma once

#include "core/bsdf/facets.h"
#include "core/bsdf/interface.h"

namespace core {

template <typename F>
struct SpecularLobeOf {
  using V = Vec3Of<F>;
  using Color = ColorOf<F>;
  Color f0;  ///< weighted
  F f90;
  Color multiple_color;
  F multiple_scale;  ///< (1 - E(wo)) / (pi (1 - E_avg))
  ThinFilmOf<F> film;
  /// The bases of a film, whose reflectance is not linear in f0.
  Color dielectric_f0, metal_f0;  ///< unweighted
  F dielectric_f90, metal_f90;    ///< weighted

  SpecularLobeOf() = default;
  /// p: has the base_color, f0 and f90 of BsdfParameters. metal, cover: weights of metal and of the
  /// dielectric. wo, average: albedos with F = 1.
  template <typename Parameters>
  SpecularLobeOf(const Parameters& p, F metal, F cover, const ThinFilmOf<F>& over,
                 const FacetsOf<F>& s, AlbedoOf<F> wo, AlbedoOf<F> average) noexcept
      : f0(p.base_color * metal + p.f0 * cover), f90(metal + p.f90 * cover) {
    multiple_scale = select(s.is_smooth, F(0), (1 - wo.e) * kInvPi / max(1 - average.e, F(1e-4F)));
    multiple_color = multiple_scattering(p.f0, Color(p.f90), average.e) * cover;
    if (any(metal > 0)) {
      multiple_color =
          multiple_color + multiple_scattering(p.base_color, Color(F(1)), average.e) * metal;
    }
    if (over.exists) {
      film = over;
      dielectric_f0 = p.f0;
      dielectric_f90 = p.f90 * cover;
      metal_f0 = p.base_color;
      metal_f90 = metal;
    }
  }
  /// Returns the reflectance of a facet.
  Color fresnel(F cos_oh) const noexcept {
    const Color plain = fresnel_schlick(f0, f90, cos_oh);
    return film.exists ? with_film(cos_oh, plain) : plain;
  }
  /// Returns the fraction of light from wo reflected by single scattering; by a film, that at the
  /// view angle.
  Color albedo(const FacetsOf<F>& s, AlbedoOf<F> wo) const noexcept {
    const Color plain = fresnel_schlick(f0, f90, s.wo.z);
    const Color rough = f0 * (wo.e - wo.e5) + Color(f90 * wo.e5);
    const Color bare = select(s.is_smooth, plain, rough);
    return film.exists
               ? film.mixed(bare, with_film(s.wo.z, plain) * select(s.is_smooth, F(1), wo.e))
               : bare;
  }
  Color multiple_albedo(const FacetsOf<F>& s, AlbedoOf<F> wo) const noexcept {
    return select(s.is_smooth, Color(F(0)), multiple_color * (1 - wo.e));
  }
  /// Returns the BSDF of multiple scattering; e: albedo at wi with F = 1.
  Color multiple(AlbedoOf<F> e) const noexcept {
    return multiple_color * (multiple_scale * (1 - e.e));
  }
  /// Returns single scattering to wi, above the surface, unless the facets are smooth.
  BsdfEvalOf<F> single(const FacetsOf<F>& s, F prob, V wi) const noexcept {
    const V h = s.half(wi);
    const auto reflection = s.reflection(prob, wi, h);
    return {fresnel(dot(s.wo, h)) * reflection.value_cos, reflection.pdf_solid_angle};
  }

 private:
  [[gnu::noinline]] Color with_film(F cos_oh, Color bare) const noexcept {
    const F mu = max(cos_oh, F(0));
    return film.mixed(bare, film.fresnel(mu, dielectric_f0, dielectric_f90) +
                                film.fresnel(mu, metal_f0, metal_f90));
  }
};
using SpecularLobe = SpecularLobeOf<float>;

}  // namespace core
