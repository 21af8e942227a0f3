/// SpecularLobe: GGX reflection of metal and of the dielectric interface, with multiple scattering.
///
/// Multiple scattering between facets is diffuse (Kulla and Conty 2017).
#pragma once

#include "core/bsdf/cover.h"
#include "core/bsdf/facets.h"

namespace core {

struct SpecularLobe {
  Rgb f0;  ///< weighted
  Rgb f90;
  ThinFilm film;
  Rgb film_f0;
  Rgb multiple_color;
  float multiple_scale = 0;  ///< (1 - E(wo)) / (pi (1 - E_avg))

  SpecularLobe() = default;
  /// metal, cover: weights of metal and of the dielectric. wo, average: albedos with F = 1.
  SpecularLobe(const BsdfParameters& p, float metal, float cover, const Facets& s,
               const ThinFilm& over, SpecularAlbedo wo, SpecularAlbedo average) noexcept
      : f0(p.base_color * metal + p.f0 * cover), f90(metal + p.f90 * cover) {
    if (over.weight > 0) {
      film = over;
      film_f0 = f0 / (metal + cover);
    }
    multiple_scale = s.is_smooth ? 0.0F : (1 - wo.e) * kInvPi / std::max(1 - average.e, 1e-4F);
    multiple_color = multiple_scattering(p.f0, Rgb(p.f90), average.e) * cover;
    if (metal > 0) {
      multiple_color += multiple_scattering(p.base_color, Rgb(1), average.e) * metal;
    }
  }
  /// Returns the fraction of light from wo reflected by single scattering; films are evaluated at
  /// the view angle.
  Rgb albedo(const Facets& s, SpecularAlbedo wo) const noexcept {
    const Rgb plain =
        s.is_smooth ? fresnel_schlick(f0, f90, s.wo.z) : f0 * (wo.e - wo.e5) + f90 * wo.e5;
    if (!(film.weight > 0)) {
      return plain;
    }
    return plain * (1 - film.weight) +
           fresnel(s.wo.z) * (s.is_smooth ? film.weight : film.weight * wo.e);
  }
  Rgb multiple_albedo(const Facets& s, SpecularAlbedo wo) const noexcept {
    return s.is_smooth ? Rgb{} : multiple_color * (1 - wo.e);
  }
  Rgb fresnel(float cos_oh) const noexcept {
    const Rgb plain = fresnel_schlick(f0, f90, cos_oh);
    if (!(film.weight > 0)) {
      return plain;
    }
    return plain * (1 - film.weight) +
           film.fresnel(std::max(cos_oh, 0.0F), film_f0) * (f90 * film.weight);
  }
  /// Returns the BSDF of multiple scattering; e: albedo at wi.
  Rgb multiple(SpecularAlbedo e) const noexcept {
    return multiple_color * (multiple_scale * (1 - e.e));
  }

  void add(const Facets& s, float prob, Vec3 wi, BsdfEval& out) const noexcept {
    if (s.is_smooth) {
      return;
    }
    const Vec3 h = s.half(wi);
    const float cos_oh = dot(s.wo, h);
    const float common = s.reflected(h);
    const float lambda_o = s.ggx.lambda(s.wo);
    const float g2 = 1 / (1 + lambda_o + s.ggx.lambda(wi));
    out.value_cos += fresnel(cos_oh) * (common * g2);
    out.pdf_solid_angle += prob * common / (1 + lambda_o);
  }
  bool sample(const Facets& s, LobeShare share, Vec2 u, BsdfSample& out) const noexcept {
    if (s.is_smooth) {
      out.wi_local = {-s.wo.x, -s.wo.y, s.wo.z};
      out.weight = fresnel(s.wo.z) * (share.open / share.prob);
      out.is_delta = true;
      return true;
    }
    out.wi_local = s.sample_reflected(u);
    return out.wi_local.z > 0;
  }
};

}  // namespace core
