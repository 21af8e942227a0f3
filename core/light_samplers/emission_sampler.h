/// EmissionSampler: samples emitted rays, for paths that start at lights.
///
/// A light in proportion to its power; a point of it, uniform over its area
/// (far lights: over the disk through which they light the scene's bounding sphere); a direction,
/// with density proportional to what the light emits that way (cosine on triangles, the falloff of
/// a spot, the luminance of the environment). Source: Veach 1997, 8.3.2; PBR 3rd ed. 16.1.2.
#pragma once

#include <cstdint>

#include "core/accel/accel.h"
#include "core/lights/environment.h"
#include "core/sampling/distribution.h"
#include "core/scene/scene_data.h"

namespace core {

/// Densities of an EmissionSample.
struct EmissionPdf {
  float prob_light = 0;       ///< of the light
  float pdf_area = 0;         ///< of the origin [1/m^2]; 1 for point and spot lights
  float pdf_solid_angle = 0;  ///< of the direction [1/sr]; 1 for directional lights
};

struct EmissionSample {
  Ray ray;                          ///< away from the light, off its surface
  Vec3 normal;                      ///< unit, on the emitting side; zero where the light has none
  Rgb radiance;                     ///< point and spot lights: intensity; directional: irradiance
  EmissionPdf pdf;                  ///< pdf_area 0: nothing was sampled
  std::uint32_t light = kNoLight;   ///< as in LightSample
  bool is_delta_position = false;   ///< point and spot lights: rays cannot hit them
  bool is_delta_direction = false;  ///< directional lights

  /// Of a path that starts here: radiance times cosine over the density.
  Rgb weight() const noexcept;
};

class EmissionSampler {
 public:
  /// Both must outlive it; environment may be null.
  EmissionSampler(const SceneData& scene, const Environment* environment);

  bool empty() const noexcept { return powers_.size() == 0; }
  /// All u in [0,1).
  EmissionSample sample(float u_light, Vec2 u_position, Vec2 u_direction) const noexcept;
  /// Densities of a ray that leaves the light; pbrt's PDF_Le. The same for all of its points. Delta
  /// positions and directions as in EmissionPdf, for the caller to leave out.
  EmissionPdf pdf(std::uint32_t light, Vec3 direction_world) const noexcept;
  /// Share of a particle's power that arrives at this distance: KHR_lights_punctual ends lights of
  /// a range there. 1 for all others.
  float range_factor(std::uint32_t light, float distance_m) const noexcept;

 private:
  EmissionSample from_triangle(std::uint32_t light, Vec2 u_position,
                               Vec2 u_direction) const noexcept;
  EmissionSample from_other(std::uint32_t light, Vec2 u_position, Vec2 u_direction) const noexcept;
  const PunctualLight* punctual(std::uint32_t light) const noexcept;

  const SceneData& scene_;
  const Environment* environment_;  ///< null when black
  std::uint32_t triangles_ = 0;
  float radius_m_ = 0;  ///< of the disk that far lights shine through
  Distribution1D powers_;
};

}  // namespace core
