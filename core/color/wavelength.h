/// Wavelengths as samples of linear Rec.709 colour, for paths that meet dispersion.
#pragma once

#include "core/color/rgb.h"

namespace core {

struct WavelengthSample {
  float wavelength_nm = 550;
  /// Weight of a path of this wavelength in each channel, divided by the density of the
  /// wavelength. Its mean is (1, 1, 1), so white stays white; single values leave the gamut: each
  /// is in
  /// [-1.01, 3.93].
  Rgb weight = {1, 1, 1};
};

/// What light of a wavelength is in linear Rec.709, in units of luminance (CIE Y).
/// Source: Wyman, Sloan and Shirley, Simple Analytic Approximations to the CIE XYZ Color Matching
/// Functions, JCGT 2013.
Rgb color_matching(float wavelength_nm) noexcept;

/// u in [0,1). By color_matching(); the density is the least one, up to scale,
/// that keeps weights in those bounds. (None keeps them above -0.58; the bounds trade the depth of
/// negative values against the height of positive ones.)
WavelengthSample sample_wavelength(float u) noexcept;

/// Index of refraction at a wavelength. n_d: at 587.6 nm; dispersion = 20 / Abbe number.
/// Source: KHR_materials_dispersion (Cauchy's form through the Fraunhofer lines).
float dispersive_ior(float n_d, float dispersion, float wavelength_nm) noexcept;

/// Indices of refraction at the mean of 1 / wavelength^2 that each channel sees: to first order in
/// the dispersion, a function of the index has its mean over a channel's colours there.
Rgb mean_dispersive_ior(float n_d, float dispersion) noexcept;

}  // namespace core
