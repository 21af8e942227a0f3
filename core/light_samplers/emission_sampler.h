/// EmissionSampler: samples emitted rays for paths that start at lights.
///
/// It picks a light in proportion to its power; a point uniformly over the light's area (distant
/// lights: over the disk through which they light the scene's bounding sphere); and a direction
/// with density proportional to the emission (cosine on triangles, the falloff of a spot, the
/// luminance of the environment). Source: Veach 1997, 8.3.2; PBR 3rd ed. 16.1.2.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/accel/accel.h"
#include "core/lights/environment.h"
#include "core/media/medium_stack.h"
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
  Ray ray;                            ///< away from the light, off its surface
  Vec3 normal;                        ///< unit, on the emitting side; zero if the light has none
  Rgb radiance;                       ///< point and spot lights: intensity; directional: irradiance
  EmissionPdf pdf;                    ///< pdf_area 0: no sample
  std::uint32_t light = kNoLight;     ///< as in LightSample
  bool is_delta_position = false;     ///< point and spot lights: rays cannot hit them
  bool is_delta_direction = false;    ///< directional lights
  const StartMedia* start = nullptr;  ///< around the origin; null: in no solid

  /// Returns the initial throughput of a path: radiance times cosine over density.
  Rgb weight() const noexcept;
};

class EmissionSampler {
 public:
  /// Scene and environment must outlive it; environment may be null.
  EmissionSampler(const SceneData& scene, const Environment* environment);

  bool empty() const noexcept { return powers_.size() == 0; }
  /// All u in [0,1).
  EmissionSample sample(float u_light, Vec2 u_position, Vec2 u_direction) const noexcept;
  /// Returns the densities of a ray that leaves the light (pbrt's PDF_Le); the same for all points
  /// of the light. Delta positions and directions as in EmissionPdf; the caller has to leave them
  /// out.
  EmissionPdf pdf(std::uint32_t light, Vec3 direction_world) const noexcept;
  /// Makes distant lights shine towards the eye: over disks around it besides the scene's, each
  /// half as wide as the one before and as likely, down to near_m. Their density falls with the
  /// squared distance from the eye, as the pixels of a unit of area do, and is at least that of the
  /// scene's disk over the number of disks, which bounds weights. pdf() does not know of it: for
  /// particles that no other strategy competes with. Source: defensive mixtures, Hesterberg 1995.
  void aim(Vec3 eye, float near_m) noexcept;
  /// Returns the fraction of a particle's power that remains at this distance: KHR_lights_punctual
  /// limits lights with a range. 1 for all other lights.
  float range_factor(std::uint32_t light, float distance_m) const noexcept;

 private:
  EmissionSample from_triangle(std::uint32_t light, Vec2 u_position,
                               Vec2 u_direction) const noexcept;
  EmissionSample from_other(std::uint32_t light, Vec2 u_direction) const noexcept;
  const PunctualLight* punctual(std::uint32_t light) const noexcept;
  bool is_distant(std::uint32_t light) const noexcept;

  float sample_disk(Vec2 u, Ray& ray) const noexcept;
  void find_starts();
  std::uint32_t start_at(std::span<const Vec3> points);

  const SceneData& scene_;
  const Environment* environment_;  ///< null if black
  std::uint32_t triangles_ = 0;
  float radius_m_ = 0;  ///< of the disk through which distant lights shine
  int disks_ = 1;       ///< the scene's, and those around the eye
  Vec3 eye_;
  Distribution1D powers_;
  /// By light, and by side of triangles: front 2 i, back 2 i + 1. Empty: no light is in a solid.
  std::vector<std::uint32_t> start_of_;  ///< indices into starts_; 0: in no solid
  std::vector<StartMedia> starts_;
};

}  // namespace core
