/// Reflectance of a thin film on a base, as linear RGB.
#pragma once

#include "core/color/rgb.h"

namespace core {

/// Returns the reflectance. cos_outer: of the angle in air, in [0,1]; film_ior, thickness_nm: of
/// the film; base_f0: reflectance of the base at normal incidence in air. Thickness 0: the base
/// alone. wavelengths_nm: of the components; 0: red, green and blue of the standard observer.
/// Source: Belcour and Barla, A Practical Extension to Microfacet Theory for the Modeling of
/// Varying Iridescence, 2017, in the form of KHR_materials_iridescence.
Rgb thin_film_fresnel(float cos_outer, float film_ior, float thickness_nm, Rgb base_f0,
                      Rgb wavelengths_nm = {}) noexcept;

/// A film that covers part of a surface.
struct ThinFilm {
  float weight = 0;  ///< covered fraction; 0: none
  float ior = 1.3F;
  float thickness_nm = 0;
  Rgb wavelengths_nm;

  Rgb fresnel(float cos_outer, Rgb base_f0) const noexcept {
    return thin_film_fresnel(cos_outer, ior, thickness_nm, base_f0, wavelengths_nm);
  }
};

/// Returns the exact unpolarised reflectance of one dielectric film at one wavelength (Airy
/// summation). n0, n1, n2: outside, film, base. For tests and for spectral paths.
double airy_reflectance(double cos_outer, double n0, double n1, double n2, double thickness_nm,
                        double wavelength_nm) noexcept;

}  // namespace core
