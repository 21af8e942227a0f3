/// Directional albedos of anisotropic GGX lobes, tabulated at build time (albedo_tables_gen.cpp).
///
/// As SpecularAlbedo, of lobes with widths alpha_y and alpha_x = lerp(alpha_y, 1, strength^2)
/// (KHR_materials_anisotropy). Nodes: mu = t^2, |cos(phi)| = u^2 from the wide axis, and linear in
/// perceptual roughness sqrt(alpha_y) and in strength. Interpolated values differ from the
/// integrals by .002 (rms) and by .007 at most.
#pragma once

#include "core/bsdf/albedo_tables.h"
#include "core/math/vec.h"

namespace core {

inline constexpr int kAnisotropicNodes[4] = {12, 10, 8, 12};  ///< roughness, strength, phi, mu

struct AnisotropicAlbedoTables {
  using Lobe = SpecularAlbedo[kAnisotropicNodes[2]][kAnisotropicNodes[3]];
  Lobe at[kAnisotropicNodes[0]][kAnisotropicNodes[1]];
  /// 1 / pi times the integral of `at` times mu over the hemisphere.
  SpecularAlbedo average[kAnisotropicNodes[0]][kAnisotropicNodes[1]];
};

extern const AnisotropicAlbedoTables kAnisotropicAlbedoTables;

/// Widths in the terms of the tables.
struct Anisotropy {
  float roughness = 1;  ///< perceptual, of the narrow axis
  float strength = 0;   ///< 0: isotropic
  bool is_y_wide = false;

  Anisotropy() = default;
  Anisotropy(float alpha_x, float alpha_y) noexcept;
  /// w: local, in any hemisphere.
  SpecularAlbedo albedo(Vec3 w) const noexcept;
  SpecularAlbedo average() const noexcept;
};

}  // namespace core
