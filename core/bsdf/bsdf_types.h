/// Parameters of BSDFs, and the results of evaluation and sampling.
#pragma once

#include "core/bsdf/thin_film.h"
#include "core/color/lane_color.h"
#include "core/description/surface_layers.h"
#include "core/math/generic.h"

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

  ThinFilm film() const noexcept {
    return {iridescence > 0, iridescence, iridescence_ior, iridescence_thickness_nm,
            wavelengths_nm};
  }
};

/// Surfaces that transmit without a solid: walls, of BsdfParameters, and diffuse transmission, of
/// BsdfLayers. Weights are 0 where a surface has none.
template <typename F>
struct WallOf {
  F transmission;
  F diffuse;  ///< diffuse_transmission
  ColorOf<F> diffuse_color;

  MaskOf<F> exist() const noexcept { return (transmission > 0) | (diffuse > 0); }
};

/// Cosine between two normals that differ by no more than rounding: 8 steps of a float below 1.
inline constexpr float kSameNormal = 0.9999995F;

/// Returns where the shading normal and the horizon, whose z is given, coincide.
template <typename F>
auto is_flat(F ng_z) noexcept {
  return ng_z > kSameNormal;
}

template <typename F>
struct BsdfEvalOf {
  ColorOf<F> value_cos = ColorOf<F>(F(0));  ///< f * |cos theta_i| [1/sr]
  F pdf_solid_angle = 0;                    ///< density of sample() at wi, without delta lobes
};
using BsdfEval = BsdfEvalOf<float>;

template <typename F>
struct BsdfSampleOf {
  using M = MaskOf<F>;
  Vec3Of<F> wi_local;
  ColorOf<F> weight = ColorOf<F>(F(0));  ///< f * |cos| / density; black: no direction was sampled
  F pdf_solid_angle = 0;                 ///< 0 if is_delta
  M is_delta{};
  M transmitted{};  ///< wi is on the other side of the geometric surface
  M is_mirrored{};  ///< at the horizon plane
  M is_null{};      ///< wi = -wo without deflection: see null_transmittance()
  M is_glass{};     ///< from the boundary of a solid
  F eta = 1;        ///< n(wi) / n(wo); 1 unless refracted
};
using BsdfSample = BsdfSampleOf<float>;

}  // namespace core
