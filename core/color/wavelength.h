/// Samples wavelengths with weights in linear Rec.709, for paths through dispersive materials.
#pragma once

#include "core/color/rgb.h"

namespace core {

struct WavelengthSample {
  float wavelength_nm = 550;
  /// Weight of a path of this wavelength in each channel, divided by the density of the wavelength.
  /// The mean is (1, 1, 1), so white stays white. Single values can be outside the gamut: each is
  /// in [-1.01, 3.93].
  Rgb weight = {1, 1, 1};
};

/// Returns the linear Rec.709 colour of monochromatic light, in units of luminance (CIE Y). Source:
/// Wyman, Sloan and Shirley, Simple Analytic Approximations to the CIE XYZ Color Matching
/// Functions, JCGT 2013.
Rgb color_matching(float wavelength_nm) noexcept;

/// Samples a wavelength; u in [0,1). The density is the smallest function, up to scale, that keeps
/// the weights given by color_matching() within those bounds. (No density keeps them above -0.58; a
/// tighter lower bound requires a looser upper one.)
WavelengthSample sample_wavelength(float u) noexcept;

/// Returns the index of refraction at a wavelength. n_d: at 587.6 nm; dispersion = 20 / Abbe
/// number. Source: KHR_materials_dispersion (Cauchy's form through the Fraunhofer lines).
float dispersive_ior(float n_d, float dispersion, float wavelength_nm) noexcept;

/// Returns the indices of refraction at each channel's mean of 1 / wavelength^2: to first order in
/// the dispersion, a function of the index takes its mean over the channel there.
Rgb mean_dispersive_ior(float n_d, float dispersion) noexcept;

}  // namespace core
