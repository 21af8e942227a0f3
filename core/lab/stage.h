/// Stage: one point under a square light, with closed-form solutions.
///
/// A diffuse surface of albedo 1 at the origin faces up (z); a square light of radiance 1 and given
/// side is parallel to it at distance 1, centred. An opaque edge occludes the part of the light
/// with x below a threshold. Light choice, light sampling, BSDF and densities are the renderer's.
#pragma once

#include "core/bsdf/bsdf.h"
#include "core/lab/experiment.h"
#include "core/light_samplers/light_sampler.h"
#include "core/samplers/dimensions.h"
#include "core/scene/scene_data.h"

namespace core::lab {

class Stage {
 public:
  /// side > 0; hidden in [0,1]: occluded fraction of the light's width.
  Stage(double side, double hidden);
  // The sampler refers to the scene.
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  /// A direction with the integrand L cos theta (irradiance), its value without the edge, and the
  /// densities of both techniques there [1/sr].
  struct Sample {
    double value = 0;
    double unhidden = 0;
    double pdf_solid_angle = 0;        ///< of the technique that sampled it; 0: no sample
    double other_pdf_solid_angle = 0;  ///< of the other technique (light or BSDF sampling)
  };
  Sample sample_light(Vec4 u) const noexcept;
  Sample sample_bsdf(Vec4 u) const noexcept;
  /// Evaluates any direction.
  Sample toward(Vec3 wi, float pdf_solid_angle) const noexcept;

  double irradiance() const noexcept { return exact(edge_); }
  double irradiance_unhidden() const noexcept { return exact(-half_); }

 private:
  double exact(double x_from) const noexcept;
  /// Returns the density of light sampling in direction wi; 0 if wi does not hit the light.
  float pdf_light(Vec3 wi) const noexcept;
  bool meets_light(Vec3 wi) const noexcept;

  double half_;
  double edge_;  ///< the light is occluded at x below this
  SceneData scene_;
  LightSampler lights_;
  Bsdf bsdf_;
};

/// Returns the irradiance from a rectangle of radiance 1, parallel to the surface at distance 1, by
/// signed quarters. Source: Howell, A Catalog of Radiation Configuration Factors, B-3.
double rectangle_irradiance(double x0, double x1, double y0, double y1);
/// Returns that from a centred square with this side and hidden fraction of its width.
inline double square_irradiance(double side, double hidden = 0) {
  const double h = side / 2;
  return rectangle_irradiance(-h + hidden * side, h, -h, h);
}

/// Random numbers of the light sample and the BSDF sample of the renderer's first vertex.
inline const int kLightGroup = dimension_group(0, BounceGroup::kLight);
inline const int kBsdfGroup = dimension_group(0, BounceGroup::kBsdf);

/// Returns value over density; 0 if nothing was sampled.
inline double ratio(double value, const Stage::Sample& s) {
  return s.pdf_solid_angle > 0 ? value / s.pdf_solid_angle : 0;
}
inline double ratio(const Stage::Sample& s) { return ratio(s.value, s); }

constexpr ParameterInfo side_parameter(double standard) {
  return {"side", 0.05, 20, standard, false, "Side of the square light, in units of its distance."};
}

}  // namespace core::lab
