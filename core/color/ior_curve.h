/// IorCurve: index of refraction by wavelength, in the forms used by the data sheets of glass
/// makers.
#pragma once

#include <array>
#include <cstdint>

namespace core {

enum class IorFormula : std::uint8_t {
  kNone,
  kCauchy,    ///< n = a[0] + a[1] / l^2 + a[2] / l^4
  kSellmeier  ///< n^2 = 1 + sum over i of a[i] l^2 / (l^2 - c[i])
};

/// l is the wavelength in vacuum, in micrometres.
struct IorCurve {
  IorFormula formula = IorFormula::kNone;
  std::array<float, 3> a{};  ///< Cauchy: 1, um^2, um^4; Sellmeier: the dimensionless B1 to B3
  std::array<float, 3> c{};  ///< Sellmeier: C1 to C3, um^2

  bool is_known() const noexcept { return formula != IorFormula::kNone; }
  /// Index at a wavelength in nanometres. Pre: is_known().
  float at(float wavelength_nm) const noexcept;

  friend bool operator==(const IorCurve&, const IorCurve&) = default;
};

/// Fraunhofer lines at which catalogues give an index (n_d) and its dispersion, V_d = (n_d - 1) /
/// (n_F - n_C). Source: ISO 7944, as in Schott's data sheets.
inline constexpr float kLineDNm = 587.56F;
inline constexpr float kLineFNm = 486.13F;
inline constexpr float kLineCNm = 656.27F;

}  // namespace core
