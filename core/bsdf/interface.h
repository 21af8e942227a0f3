/// Interface: the dielectric interface over a diffuse or thin substrate, and its coupling to it.
///
/// A diffuse lobe below it is attenuated twice: (1 - E(wo)) (1 - E(wi)) / (1 - E_avg), with E of
/// the largest channel, so that the substrate keeps its hue (KHR_materials_specular). Source: Kulla
/// and Conty, Revisiting Physically Based Shading at Imageworks, 2017.
#pragma once

#include "core/bsdf/albedo_tables.h"
#include "core/bsdf/facets.h"
#include "core/bsdf/fresnel.h"
#include "core/bsdf/thin_film.h"

namespace core {

/// Returns the fraction of energy reflected after two or more bounces between facets. Source: Kulla
/// and Conty 2017, with F_avg = F0 + (F90 - F0) / 21 for Schlick's Fresnel. C: a channel or all.
template <typename C, typename F>
C multiple_scattering(C f0, C f90, F e_average) noexcept {
  const C f = f0 + (f90 - f0) * F(1.0F / 21.0F);
  return each_channel(f,
                      [e_average](F x) { return x * x * e_average / (1 - x * (1 - e_average)); });
}

/// Returns the mean over the hemisphere of value(mu), weighted by the cosine: at equal steps of
/// mu^2, whose weights are equal. With 8, white surfaces of f0 0.04 under films of up to 1000 nm
/// and of index 1.1 or more gain nothing in the mean of the channels, and at most 1.5% in one; with
/// two Gauss nodes, 4%.
template <typename F, typename Value>
F hemispherical_mean(Value value) noexcept {
  constexpr int kSteps = 8;
  F sum(0);
  for (int i = 0; i < kSteps; ++i) {
    sum = sum + value(sqrt(F((static_cast<float>(i) + 0.5F) / kSteps)));
  }
  return sum * F(1.0F / kSteps);
}

template <typename F>
struct InterfaceOf {
  using Color = ColorOf<F>;
  Color color_f0;  ///< of all channels; unweighted, like the next two
  F f0;            ///< of the largest channel
  F f90;
  F multiple;  ///< fraction of multiple scattering that is reflected
  F open_wo;   ///< 1 - E(wo)
  F norm;      ///< 1 / (1 - E_avg), under a coat times ClearcoatLobeOf::diffuse_scale()
  ThinFilmOf<F> film;

  InterfaceOf() = default;
  /// wo, average: albedos of the lobe s with F = 1. is_coupled: where coupling() is needed.
  InterfaceOf(Color at_normal, F at_grazing, const ThinFilmOf<F>& over, const FacetsOf<F>& s,
              AlbedoOf<F> wo, AlbedoOf<F> average, MaskOf<F> is_coupled) noexcept
      : color_f0(at_normal),
        f0(max_component(color_f0)),
        f90(at_grazing),
        multiple(multiple_scattering(f0, f90, average.e)) {
    F mean = albedo(average);
    if (over.exists) {
      film = over;
      const MaskOf<F> is_filmed = (film.weight > 0) & is_coupled;
      if (any(is_filmed)) {
        mean = select(is_filmed, mean_albedo(s.roughness), mean);
      }
    }
    open_wo = 1 - albedo(s.wo.z, wo);
    norm = 1 / max(1 - mean, F(1e-4F));
  }
  /// Returns no interface.
  static InterfaceOf none() noexcept { return {Color(F(0)), F(0), {}, {}, {}, {}, MaskOf<F>{}}; }

  /// Returns the reflectance of a facet.
  Color fresnel_rgb(F cos_oh) const noexcept {
    const Color plain = fresnel_schlick(color_f0, f90, cos_oh);
    return film.exists ? film.mixed(plain, of_film(cos_oh)) : plain;
  }
  /// Returns the reflectance of a facet in the largest channel, which transmission loses.
  F fresnel(F cos_oh) const noexcept {
    const F plain = f0 + (f90 - f0) * schlick_weight(cos_oh);
    return film.exists ? film.mixed(plain, max_component(of_film(cos_oh))) : plain;
  }
  /// Returns the albedo of single scattering without a film, e with F = 1.
  F single(AlbedoOf<F> e) const noexcept { return f0 * (e.e - e.e5) + f90 * e.e5; }
  /// Returns the albedo without a film, where single scattering has albedo e with F = 1.
  F albedo(AlbedoOf<F> e) const noexcept { return single(e) + multiple * (1 - e.e); }
  /// Returns the albedo at cosine mu, where single scattering has albedo e with F = 1.
  F albedo(F mu, AlbedoOf<F> e) const noexcept {
    return film.exists ? albedo_with_film(mu, e) : albedo(e);
  }
  /// Returns the attenuation of a diffuse lobe below; mu, e: of wi, as for albedo().
  F coupling(F mu, AlbedoOf<F> e) const noexcept { return open_wo * (1 - albedo(mu, e)) * norm; }

 private:
  [[gnu::noinline]] Color of_film(F cos_oh) const noexcept {
    return film.fresnel(max(cos_oh, F(0)), color_f0, f90);
  }
  [[gnu::noinline]] F albedo_with_film(F mu, AlbedoOf<F> e) const noexcept {
    const F plain = single(e);
    return film.mixed(plain, max_component(of_film(mu)) * e.e) + multiple * (1 - e.e);
  }
  [[gnu::noinline]] F mean_albedo(F roughness) const noexcept {
    return hemispherical_mean<F>([&](F mu) { return albedo(mu, specular_albedo(mu, roughness)); });
  }
};
using Interface = InterfaceOf<float>;

}  // namespace core
