/// Interface: the dielectric interface over a diffuse or thin substrate, and its coupling to it.
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
/// and Conty 2017, with F_avg = F0 + (F90 - F0) / 21 for Schlick's Fresnel. C: a channel or all.
template <typename C, typename F>
C multiple_scattering(C f0, C f90, F e_average) noexcept {
  const C f = f0 + (f90 - f0) * F(1.0F / 21.0F);
  return each_channel(f,
                      [e_average](F x) { return x * x * e_average / (1 - x * (1 - e_average)); });
}

/// An interface without a film.
template <typename F>
struct InterfaceOf {
  using Color = ColorOf<F>;
  Color color_f0;  ///< of all channels; unweighted, like the next two
  F f0;            ///< of the largest channel
  F f90;
  F multiple;  ///< fraction of multiple scattering that is reflected
  F open_wo;   ///< 1 - E(wo)
  F norm;      ///< 1 / (1 - E_avg), under a coat times ClearcoatLobeOf::diffuse_scale()

  InterfaceOf() = default;
  /// average: albedo of the lobe with F = 1.
  InterfaceOf(Color at_normal, F at_grazing, AlbedoOf<F> average) noexcept
      : color_f0(at_normal),
        f0(max_component(color_f0)),
        f90(at_grazing),
        multiple(multiple_scattering(f0, f90, average.e)) {}
  /// E: albedos of the interface for wo and on average.
  void set_coupling(F e_wo, F e_average) noexcept {
    open_wo = 1 - e_wo;
    norm = 1 / max(1 - e_average, F(1e-4F));
  }

  /// Returns the reflectance of a facet.
  Color fresnel_rgb(F cos_oh) const noexcept { return fresnel_schlick(color_f0, f90, cos_oh); }
  /// Returns the reflectance of a facet in the largest channel, which transmission loses.
  F fresnel(F cos_oh) const noexcept { return f0 + (f90 - f0) * schlick_weight(cos_oh); }
  /// Returns the albedo of single scattering, e with F = 1.
  F single(AlbedoOf<F> e) const noexcept { return f0 * (e.e - e.e5) + f90 * e.e5; }
  /// Returns the albedo where single scattering has albedo e with F = 1.
  F albedo(AlbedoOf<F> e) const noexcept { return single(e) + multiple * (1 - e.e); }
  /// Returns the attenuation of a diffuse lobe below. e_wi: that of the interface for wi.
  F coupling(F e_wi) const noexcept { return open_wo * (1 - e_wi) * norm; }
};

struct Interface : InterfaceOf<float> {
  ThinFilm film;

  /// No interface.
  Interface() noexcept : InterfaceOf(Rgb{}, 0, {}) { set_coupling(0, 0); }
  /// wo, average: albedos of the lobe with F = 1; mu: cosine of wo.
  Interface(const BsdfParameters& p, const ThinFilm& over, float roughness, float mu,
            SpecularAlbedo wo, SpecularAlbedo average) noexcept
      : InterfaceOf(p.f0, p.f90, average), film(over) {
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
    set_coupling(albedo(mu, wo), mean);
  }

  /// As without a film.
  Rgb fresnel_rgb(float cos_oh) const noexcept {
    const Rgb plain = InterfaceOf::fresnel_rgb(cos_oh);
    return film.weight > 0
               ? lerp(plain, film.fresnel(std::max(cos_oh, 0.0F), color_f0) * f90, film.weight)
               : plain;
  }
  float fresnel(float cos_oh) const noexcept {
    const float plain = InterfaceOf::fresnel(cos_oh);
    return film.weight > 0
               ? lerp(plain, max_component(film.fresnel(std::max(cos_oh, 0.0F), color_f0)) * f90,
                      film.weight)
               : plain;
  }
  /// Returns the albedo at cosine mu, where single scattering has albedo e with F = 1.
  float albedo(float mu, SpecularAlbedo e) const noexcept {
    if (!(film.weight > 0)) {
      return InterfaceOf::albedo(e);
    }
    const float seen = max_component(film.fresnel(mu, color_f0)) * f90 * e.e;
    return lerp(single(e), seen, film.weight) + multiple * (1 - e.e);
  }
  /// Returns the attenuation of a diffuse lobe below; e: albedo at wi with F = 1.
  float coupling(float mu, SpecularAlbedo e) const noexcept {
    return InterfaceOf::coupling(albedo(mu, e));
  }
};

}  // namespace core
