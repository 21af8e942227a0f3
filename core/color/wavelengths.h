/// Wavelengths: three of them, which a path carries in the places of red, green and blue.
///
/// A colour stands for the spectrum r R + g G + b B (times that of D65 where it is light). R, G and
/// B are shares of one: softmax of 0 and two quadratics in the wavelength, whose six coefficients
/// are those with which each has its own colour under D65. So every spectrum of colours in [0,1] is
/// smooth and in [0,1], white is flat, and what is linear in colour is linear at each wavelength.
/// Sources: Wilkie, Nawaz, Droske, Weidlich and Hanika, Hero Wavelength Spectral Sampling, EGSR
/// 2014 (wavelengths that share a path); Mallett and Yuksel, Spectral Primary Decomposition for
/// Rendering with sRGB Reflectance, EGSR 2019 (shares of one); Jakob and Hanika, A Low-Dimensional
/// Function Space for Efficient Spectral Upsampling, Eurographics 2019 (a sigmoid of a quadratic).
#pragma once

#include <array>

#include "core/color/rgb.h"

namespace core {

class Wavelengths {
 public:
  /// u in [0,1). Each wavelength is from a third of their distribution, the longest first; the
  /// distances are equal ones of probability. The density is in proportion to the length of what
  /// color() makes of a wavelength, as a vector: the one that leaves white the least noise.
  explicit Wavelengths(float u) noexcept;

  /// Nanometres, in [380, 780].
  Rgb nm() const noexcept { return nm_; }
  /// Of a colour, at the wavelengths: reflectance, or light over D65's.
  Rgb values(Rgb color) const noexcept {
    return {dot3(shares_[0], color), dot3(shares_[1], color), dot3(shares_[2], color)};
  }
  /// Of light over D65's at the wavelengths: the colour, divided by their density. Its mean over u
  /// is the colour of the spectrum under the CIE 1931 observer.
  Rgb color(Rgb values) const noexcept {
    return seen_[0] * values.r + seen_[1] * values.g + seen_[2] * values.b;
  }

 private:
  static constexpr float dot3(Rgb a, Rgb b) noexcept { return a.r * b.r + a.g * b.g + a.b * b.b; }

  Rgb nm_;
  std::array<Rgb, 3> shares_;
  std::array<Rgb, 3> seen_;
};

}  // namespace core
