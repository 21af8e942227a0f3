/// Wavelengths: the three wavelengths of a path, carried in place of red, green and blue.
///
/// A colour stands for the spectrum r R + g G + b B (times the spectrum of D65 for emission). R, G
/// and B sum to one: they are the softmax of 0 and two quadratics in the wavelength, with the six
/// coefficients chosen so that each reproduces its colour under D65. So the spectrum of every
/// colour in [0,1] is smooth and in [0,1], white is flat, and quantities linear in colour are
/// linear at each wavelength. Sources: Wilkie, Nawaz, Droske, Weidlich and Hanika, Hero Wavelength
/// Spectral Sampling, EGSR 2014 (several wavelengths per path); Mallett and Yuksel, Spectral
/// Primary Decomposition for Rendering with sRGB Reflectance, EGSR 2019 (basis spectra that sum to
/// one); Jakob and Hanika, A Low-Dimensional Function Space for Efficient Spectral Upsampling,
/// Eurographics 2019 (a sigmoid of a quadratic).
#pragma once

#include <array>

#include "core/color/rgb.h"

namespace core {

class Wavelengths {
 public:
  /// u in [0,1). Samples one wavelength from each third of the distribution, the longest first, at
  /// equal distances in probability. The density is proportional to the length of the vector that
  /// color() returns for a wavelength: this minimises the noise of white.
  explicit Wavelengths(float u) noexcept;

  /// Wavelengths in nanometres, in [380, 780].
  Rgb nm() const noexcept { return nm_; }
  /// Values of a colour at the wavelengths: reflectance, or emission relative to D65.
  Rgb values(Rgb color) const noexcept {
    return {dot3(shares_[0], color), dot3(shares_[1], color), dot3(shares_[2], color)};
  }
  /// The colour of values at the wavelengths, relative to D65 and divided by their density. The
  /// mean over u is the colour of the spectrum for the CIE 1931 observer.
  Rgb color(Rgb values) const noexcept {
    return seen_[0] * values.r + seen_[1] * values.g + seen_[2] * values.b;
  }

  /// The nine factors of values(), row by row, followed by others: for batched use.
  const float* shares() const noexcept { return &shares_[0].r; }

 private:
  static constexpr float dot3(Rgb a, Rgb b) noexcept { return a.r * b.r + a.g * b.g + a.b * b.b; }

  Rgb nm_;
  std::array<Rgb, 3> shares_;
  std::array<Rgb, 3> seen_;
};

}  // namespace core
