#include "core/color/ior_curve.h"

#include <cmath>

namespace core {

float IorCurve::at(float wavelength_nm) const noexcept {
  const float um = wavelength_nm / 1000;
  const float um2 = um * um;
  if (formula == IorFormula::kCauchy) {
    return a[0] + (a[1] + a[2] / um2) / um2;
  }
  float n2 = 1;
  for (std::size_t i = 0; i < a.size(); ++i) {
    n2 += a[i] * um2 / (um2 - c[i]);
  }
  return std::sqrt(n2);
}

}  // namespace core
