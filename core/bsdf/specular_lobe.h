/// SpecularLobe: GGX reflection of metal and of the dielectric interface, with multiple scattering.
///
/// Multiple scattering between facets is diffuse (Kulla and Conty 2017).
#pragma once

#include "core/bsdf/facets.h"
#include "core/bsdf/interface.h"

namespace core {

/// The lobe without a film.
template <typename F>
struct PlainSpecularOf {
  using Color = ColorOf<F>;
  Color f0;  ///< weighted
  F f90;
  Color multiple_color;
  F multiple_scale;  ///< (1 - E(wo)) / (pi (1 - E_avg))

  PlainSpecularOf() = default;
  /// p: has the base_color, f0 and f90 of BsdfParameters. metal, cover: weights of metal and of the
  /// dielectric. wo, average: albedos with F = 1.
  template <typename Parameters>
  PlainSpecularOf(const Parameters& p, F metal, F cover, const FacetsOf<F>& s, AlbedoOf<F> wo,
                  AlbedoOf<F> average) noexcept
      : f0(p.base_color * metal + p.f0 * cover), f90(metal + p.f90 * cover) {
    multiple_scale = select(s.is_smooth, F(0), (1 - wo.e) * kInvPi / max(1 - average.e, F(1e-4F)));
    multiple_color = multiple_scattering(p.f0, Color(p.f90), average.e) * cover;
    if (any(metal > 0)) {
      multiple_color =
          multiple_color + multiple_scattering(p.base_color, Color(F(1)), average.e) * metal;
    }
  }
  Color fresnel(F cos_oh) const noexcept { return fresnel_schlick(f0, f90, cos_oh); }
  /// Returns the fraction of light from wo reflected by single scattering.
  Color albedo(const FacetsOf<F>& s, AlbedoOf<F> wo) const noexcept {
    return select(s.is_smooth, fresnel(s.wo.z), f0 * (wo.e - wo.e5) + Color(f90 * wo.e5));
  }
  Color multiple_albedo(const FacetsOf<F>& s, AlbedoOf<F> wo) const noexcept {
    return select(s.is_smooth, Color(F(0)), multiple_color * (1 - wo.e));
  }
  /// Returns the BSDF of multiple scattering; e: albedo at wi with F = 1.
  Color multiple(AlbedoOf<F> e) const noexcept {
    return multiple_color * (multiple_scale * (1 - e.e));
  }
};

struct SpecularLobe : PlainSpecularOf<float> {
  ThinFilm film;
  Rgb film_f0;

  SpecularLobe() = default;
  SpecularLobe(const BsdfParameters& p, float metal, float cover, const Facets& s,
               const ThinFilm& over, SpecularAlbedo wo, SpecularAlbedo average) noexcept
      : PlainSpecularOf(p, metal, cover, s, wo, average) {
    if (over.weight > 0) {
      film = over;
      film_f0 = f0 / (metal + cover);
    }
  }
  /// As without a film, which is evaluated at the view angle.
  Rgb albedo(const Facets& s, SpecularAlbedo wo) const noexcept {
    const Rgb plain = PlainSpecularOf::albedo(s, wo);
    if (!(film.weight > 0)) {
      return plain;
    }
    return plain * (1 - film.weight) +
           fresnel(s.wo.z) * (s.is_smooth ? film.weight : film.weight * wo.e);
  }
  Rgb fresnel(float cos_oh) const noexcept {
    const Rgb plain = PlainSpecularOf::fresnel(cos_oh);
    if (!(film.weight > 0)) {
      return plain;
    }
    return plain * (1 - film.weight) +
           film.fresnel(std::max(cos_oh, 0.0F), film_f0) * (f90 * film.weight);
  }

  void add(const Facets& s, float prob, Vec3 wi, BsdfEval& out) const noexcept {
    if (s.is_smooth) {
      return;
    }
    const Vec3 h = s.half(wi);
    const auto reflection = s.reflection(prob, wi, h);
    out.value_cos += fresnel(dot(s.wo, h)) * reflection.value_cos;
    out.pdf_solid_angle += reflection.pdf_solid_angle;
  }
  bool sample(const Facets& s, LobeShare share, Vec2 u, BsdfSample& out) const noexcept {
    out.wi_local = s.sample_reflected(u);
    if (s.is_smooth) {
      out.weight = fresnel(s.wo.z) * (share.open / share.prob);
      out.is_delta = true;
      return true;
    }
    return out.wi_local.z > 0;
  }
};

}  // namespace core
