/// White balance: colours as if the light had the colour of the display's white.
#pragma once

#include "core/color/rgb.h"

namespace core {

class WhiteBalance {
 public:
  /// kelvin: colour temperature of the light that becomes white, in [1000, 40000]. A black body of
  /// it (Planck's law, with the CIE 1931 observer) becomes grey of the same luminance, by
  /// Bradford's chromatic adaptation. Source: Lam, Metamerism and Colour Constancy, Bradford 1985;
  /// the matrix is that of ICC.1, annex E.
  explicit WhiteBalance(float kelvin);

  /// linear: Rec.709. Components of saturated colours can become negative.
  Rgb operator()(Rgb linear) const noexcept {
    return red_ * linear.r + green_ * linear.g + blue_ * linear.b;
  }

 private:
  Rgb red_;  ///< What the primaries become.
  Rgb green_;
  Rgb blue_;
};

}  // namespace core
