/// Cover: the dielectric interface over a diffuse or thin substrate, and its coupling to it.
///
/// A diffuse lobe below it is attenuated twice: (1 - E(wo)) (1 - E(wi)) / (1 - E_avg), with E of
/// the largest channel, so that the substrate keeps its hue (KHR_materials_specular). Source: Kulla
/// and Conty, Revisiting Physically Based Shading at Imageworks, 2017.
#pragma once

#include <algorithm>

#include "core/bsdf/albedo_tables.h"
#include "core/bsdf/bsdf_types.h"
#include "core/bsdf/fresnel.h"
#include "core/bsdf/thin_film.h"
#include "core/math/numbers.h"

namespace core {

/// Returns the fraction of energy reflected after two or more bounces between facets. Source: Kulla
/// and Conty 2017, with F_avg = F0 + (F90 - F0) / 21 for Schlick's Fresnel.
inline Rgb multiple_scattering(Rgb f0, Rgb f90, float e_average) noexcept {
  const Rgb f = f0 + (f90 - f0) * (1.0F / 21.0F);
  const auto channel = [e_average](float x) {
    return x * x * e_average / (1 - x * (1 - e_average));
  };
  return {channel(f.r), channel(f.g), channel(f.b)};
}

struct Cover {
  float f0 = 0;  ///< of the largest channel; unweighted
  float f90 = 0;
  float multiple = 0;  ///< fraction of multiple scattering that is reflected
  ThinFilm film;
  Rgb film_f0;        ///< of all channels, with or without a film
  float open_wo = 1;  ///< 1 - E(wo)
  float norm = 1;     ///< 1 / (1 - E_avg)

  Cover() = default;
  /// wo, average: albedos of the lobe with F = 1; mu: cosine of wo.
  Cover(const BsdfParameters& p, const ThinFilm& over, float roughness, float mu, SpecularAlbedo wo,
        SpecularAlbedo average) noexcept
      : f0(max_component(p.f0)),
        f90(p.f90),
        multiple(multiple_scattering(Rgb(f0), Rgb(f90), average.e).r),
        film(over),
        film_f0(p.f0),
        open_wo(1 - albedo(mu, wo)) {
    // The mean over the hemisphere; for a film by two-point Gauss quadrature for the weight 2 mu.
    constexpr float kMu[2] = {0.3550510F, 0.8449490F};
    constexpr float kWeight[2] = {0.3639173F, 0.6360827F};
    float mean = 0;
    if (film.weight > 0) {
      for (int i = 0; i < 2; ++i) {
        mean += kWeight[i] * albedo(kMu[i], specular_albedo(kMu[i], roughness));
      }
    } else {
      mean = albedo(1, average);
    }
    norm = 1 / std::max(1 - mean, 1e-4F);
  }

  /// Returns the reflectance of a facet.
  Rgb fresnel_rgb(float cos_oh) const noexcept {
    const Rgb plain = fresnel_schlick(film_f0, Rgb(f90), cos_oh);
    return film.weight > 0
               ? lerp(plain, film.fresnel(std::max(cos_oh, 0.0F), film_f0) * f90, film.weight)
               : plain;
  }
  /// Returns the reflectance of a facet in the largest channel, which transmission loses.
  float fresnel(float cos_oh) const noexcept {
    const float plain = lerp(f0, f90, schlick_weight(cos_oh));
    return film.weight > 0
               ? lerp(plain, max_component(film.fresnel(std::max(cos_oh, 0.0F), film_f0)) * f90,
                      film.weight)
               : plain;
  }
  /// Returns the albedo at cosine mu, where single scattering has albedo e.
  float albedo(float mu, SpecularAlbedo e) const noexcept {
    float single = f0 * (e.e - e.e5) + f90 * e.e5;
    if (film.weight > 0) {
      single = lerp(single, max_component(film.fresnel(mu, film_f0)) * f90 * e.e, film.weight);
    }
    return single + multiple * (1 - e.e);
  }
  /// Returns the attenuation of a diffuse lobe below.
  float coupling(float mu, SpecularAlbedo e) const noexcept {
    return open_wo * (1 - albedo(mu, e)) * norm;
  }
};

}  // namespace core
