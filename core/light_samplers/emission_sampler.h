/// EmissionSampler: samples emitted rays for paths that start at lights.
///
/// It picks a light in proportion to its power; a point uniformly over the light's area (distant
/// lights: over the disk through which they light the scene's bounding sphere); and a direction
/// with density proportional to the emission (cosine on triangles, the falloff of a spot, the
/// luminance of the environment). Source: Veach 1997, 8.3.2; PBR 3rd ed. 16.1.2.
///
/// Lights may be aimed at balls: distant ones then shine over the disks that these cover, too, and
/// others into the cones. The densities are those of the mixture, in which all that an unaimed
/// light reaches keeps a share. Source: defensive mixtures, Hesterberg 1995.
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

/// A ball at which lights are aimed.
struct EmissionTarget {
  Vec3 center;
  float radius_m = 0;
  float share = 0;  ///< of the light paths; the sum over all targets is less than 1
};

class EmissionSampler {
 public:
  /// Scene and environment must outlive it; environment may be null.
  EmissionSampler(const SceneData& scene, const Environment* environment);

  bool empty() const noexcept { return powers_.size() == 0; }
  std::size_t size() const noexcept { return powers_.size(); }  ///< number of lights
  /// All u in [0,1).
  EmissionSample sample(float u_light, Vec2 u_position, Vec2 u_direction) const noexcept;
  /// Returns the densities of a ray that leaves the light (pbrt's PDF_Le). origin: where, or of a
  /// distant light any point of the ray. Delta positions and directions as in EmissionPdf; the
  /// caller has to leave them out.
  EmissionPdf pdf(std::uint32_t light, Vec3 origin, Vec3 direction_world) const noexcept;
  /// Aims all lights. light_shares: of the light paths, for each light, besides its power, with the
  /// same weight as the targets together; all zero: only the power counts.
  void aim(std::vector<EmissionTarget> targets, const std::vector<float>& light_shares);
  /// Aims distant lights at balls around the eye, each half as wide as the one before and as
  /// likely, down to near_m: their density falls with the squared distance from the eye, as the
  /// pixels of a unit of area do.
  void aim(Vec3 eye, float near_m);
  /// Returns the fraction of a particle's power that remains at this distance: KHR_lights_punctual
  /// limits lights with a range. 1 for all other lights.
  float range_factor(std::uint32_t light, float distance_m) const noexcept;

 private:
  EmissionSample from_triangle(std::uint32_t light, Vec2 u_position, Vec2 u_direction,
                               const EmissionTarget* target) const noexcept;
  EmissionSample from_other(std::uint32_t light, Vec2 u_direction,
                            const EmissionTarget* target) const noexcept;
  const PunctualLight* punctual(std::uint32_t light) const noexcept;
  bool is_distant(std::uint32_t light) const noexcept;

  /// Returns the target that u chooses, null for none, and stretches its interval to [0,1).
  const EmissionTarget* choose_target(float& u) const noexcept;
  /// Returns the density over the disk of a distant light, or over directions of another one, that
  /// targets add. chosen: contains the ray, whatever rounding says.
  float pdf_targets(Vec3 origin, Vec3 direction, bool is_distant,
                    const EmissionTarget* chosen = nullptr) const noexcept;
  float pdf_disk(Vec3 origin, Vec3 direction,
                 const EmissionTarget* chosen = nullptr) const noexcept;
  /// Moves the origin of the ray to a point of one of the disks, on the plane that touches the
  /// scene's bounding sphere from behind. Returns its density [1/m^2].
  float sample_disk(Vec2 u, Ray& ray) const noexcept;
  float own_pdf_solid_angle(std::uint32_t light, Vec3 direction_world) const noexcept;
  void find_starts();
  std::uint32_t start_at(std::span<const Vec3> points);

  const SceneData& scene_;
  const Environment* environment_;  ///< null if black
  std::uint32_t triangles_ = 0;
  float radius_m_ = 0;  ///< of the disk through which distant lights shine
  std::vector<EmissionTarget> targets_;
  float own_share_ = 1;      ///< what targets leave
  bool aims_local_ = false;  ///< also lights that are not distant
  Distribution1D powers_;
  /// By light, and by side of triangles: front 2 i, back 2 i + 1. Empty: no light is in a solid.
  std::vector<std::uint32_t> start_of_;  ///< indices into starts_; 0: in no solid
  std::vector<StartMedia> starts_;
};

}  // namespace core
