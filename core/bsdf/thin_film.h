/// Reflectance of a thin film on a base, as linear RGB.
#pragma once

#include <bit>
#include <cstddef>
#include <type_traits>

#include "core/color/lane_color.h"

namespace core {

/// Returns the reflectance. cos_outer: of the angle in air, in [0,1]; film_ior, thickness_nm: of
/// the film; base_f0: reflectance of the base at normal incidence in air. Thickness 0: the base
/// alone. wavelengths_nm: of the components; 0: red, green and blue of the standard observer.
/// Source: Belcour and Barla, A Practical Extension to Microfacet Theory for the Modeling of
/// Varying Iridescence, 2017, in the form of KHR_materials_iridescence.
Rgb thin_film_fresnel(float cos_outer, float film_ior, float thickness_nm, Rgb base_f0,
                      Rgb wavelengths_nm = {}) noexcept;

/// A film that covers part of a surface.
template <typename F>
struct ThinFilmOf {
  using Color = ColorOf<F>;
  bool exists = false;  ///< in any lane; the rest is unspecified if not
  F weight;             ///< covered fraction; 0: none
  F ior, thickness_nm;
  Color wavelengths_nm;

  /// Returns `bare`, or the mixture with `filmed` where there is a film.
  template <typename T>
  T mixed(T bare, T filmed) const noexcept {
    return select(weight > 0, bare * (1 - weight) + filmed * weight, bare);
  }
  /// Returns the reflectance times f90. Evaluated lane by lane, and 0 in those without a film or of
  /// f90 0.
  Color fresnel(F cos_outer, Color base_f0, F f90) const noexcept {
    if constexpr (std::is_same_v<F, float>) {
      return f90 > 0
                 ? thin_film_fresnel(cos_outer, ior, thickness_nm, base_f0, wavelengths_nm) * f90
                 : Color(0);
    } else {
      Color out(F(0));
      const auto rgb = [](Vec3 c) { return Rgb{c.x, c.y, c.z}; };
      for (unsigned rest = ((weight > 0) & (f90 > 0)).bits(); rest != 0; rest &= rest - 1) {
        const auto k = static_cast<std::size_t>(std::countr_zero(rest));
        const Rgb one = thin_film_fresnel(cos_outer.v[k], ior.v[k], thickness_nm.v[k],
                                          rgb(base_f0.lane(k)), rgb(wavelengths_nm.lane(k)));
        out.set(k, {one.r, one.g, one.b});
      }
      return out * f90;
    }
  }
};
using ThinFilm = ThinFilmOf<float>;

/// Returns the exact unpolarised reflectance of one dielectric film at one wavelength (Airy
/// summation). n0, n1, n2: outside, film, base. For tests and for spectral paths.
double airy_reflectance(double cos_outer, double n0, double n1, double n2, double thickness_nm,
                        double wavelength_nm) noexcept;

}  // namespace core
