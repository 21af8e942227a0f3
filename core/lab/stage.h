/// Stage: one point under a square light, for which everything is known in closed form.
///
/// A diffuse surface of albedo 1 at the origin faces up (z); a square light of radiance 1 and given
/// side hangs parallel above it at distance 1, centred. An opaque edge hides the part of the light
/// with x below a threshold. Light choice, light sampling, BSDF and densities are the renderer's.
#pragma once

#include "core/bsdf/bsdf.h"
#include "core/light_samplers/light_sampler.h"
#include "core/scene/scene_data.h"

namespace core::lab {

class Stage {
 public:
  /// side > 0; hidden in [0,1]: share of the light's width that is hidden.
  Stage(double side, double hidden);
  // The sampler refers to the scene.
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  /// A direction with the integrand L cos theta (irradiance), what it would be without the edge,
  /// and the densities of the techniques there [1/sr].
  struct Sample {
    double value = 0;
    double unhidden = 0;
    double pdf_solid_angle = 0;        ///< of the technique that made it; 0: nothing was sampled
    double other_pdf_solid_angle = 0;  ///< of the other of light and BSDF sampling
  };
  Sample sample_light(Vec4 u) const noexcept;
  Sample sample_bsdf(Vec4 u) const noexcept;
  /// Any direction.
  Sample look(Vec3 wi, float pdf_solid_angle) const noexcept;

  double irradiance() const noexcept { return exact(edge_); }
  double irradiance_unhidden() const noexcept { return exact(-half_); }

 private:
  double exact(double x_from) const noexcept;
  /// Density of light sampling in direction wi; 0 where it does not meet the light.
  float pdf_light(Vec3 wi) const noexcept;
  bool meets_light(Vec3 wi) const noexcept;

  double half_;
  double edge_;  ///< light with x below this is hidden
  SceneData scene_;
  LightSampler lights_;
  Bsdf bsdf_;
};

/// Irradiance from a rectangle of radiance 1, parallel to the surface at distance 1, by signed
/// quarters. Source: Howell, A Catalog of Radiation Configuration Factors, B-3.
double rectangle_irradiance(double x0, double x1, double y0, double y1);

}  // namespace core::lab
