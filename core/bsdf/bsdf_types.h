/// Parameters of BSDFs, and the results of evaluation and sampling.
#pragma once

#include "core/color/rgb.h"
#include "core/description/surface_layers.h"
#include "core/math/vec.h"

namespace core {

/// The parameters of glTF after texturing. Colours in [0,1].
struct BsdfParameters {
  Rgb base_color = {1, 1, 1};
  float metallic = 0;
  float roughness = 1;  ///< perceptual
  float alpha_x = 1;    ///< GGX widths; equal unless anisotropic
  float alpha_y = 1;
  Rgb f0 = {0.04F, 0.04F, 0.04F};  ///< of the dielectric, including KHR_materials_ior and _specular
  float f90 = 1;                   ///< of the dielectric
  Rgb specular_color = {
      1, 1,
      1};  ///< KHR_materials_specular, not clamped: for F0 of solid glass, whose ior is relative
  float transmission = 0;
  bool thin = true;     ///< transmission without refraction
  float ior = 1.5F;     ///< of the solid relative to its surroundings; may be below 1
  bool inside = false;  ///< wo is in the solid
  Rgb reflection_weight = {
      1, 1, 1};  ///< of reflection at solid glass for paths with one wavelength; may be negative
  Rgb refraction_weight = {1, 1, 1};  ///< of refraction at solid glass
};

/// The less common layers, stored separately so that other surfaces do not carry them.
struct BsdfLayers : SurfaceLayers {
  Vec3 clearcoat_normal = {0, 0, 1};  ///< local frame; has its own normal map
  float iridescence_thickness_nm = 0;
  Rgb wavelengths_nm;  ///< wavelengths of the colour components; 0: red, green and blue
};

/// Cosine between two normals that differ by no more than rounding: 8 steps of a float below 1.
inline constexpr float kSameNormal = 0.9999995F;

/// Returns where the shading normal and the horizon, whose z is given, coincide.
template <typename F>
auto is_flat(F ng_z) noexcept {
  return ng_z > kSameNormal;
}

struct BsdfEval {
  Rgb value_cos;              ///< f * |cos theta_i| [1/sr]
  float pdf_solid_angle = 0;  ///< density of sample() at wi, without delta lobes
};

struct BsdfSample {
  Vec3 wi_local;
  Rgb weight;                 ///< f * |cos| / density
  float pdf_solid_angle = 0;  ///< 0 if is_delta
  bool is_delta = false;
  bool transmitted = false;  ///< wi is on the other side of the geometric surface
  bool is_mirrored = false;  ///< at the horizon plane
  bool is_null = false;      ///< wi = -wo without deflection: see null_transmittance()
  bool is_glass = false;     ///< from the boundary of a solid
  float eta = 1;             ///< n(wi) / n(wo); 1 unless refracted
};

/// A lobe's sampling probability, and the fraction that the layers above let through if it is
/// smooth.
struct LobeShare {
  float prob = 1;
  float open = 1;
};

}  // namespace core
