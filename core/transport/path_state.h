/// PathState: a path between two vertices while it is traced.
///
/// Source of the path tracing loop: PBR 4th ed., section 14.1.
#pragma once

#include <cstdint>

#include "core/accel/accel.h"
#include "core/camera/camera.h"
#include "core/materials/shade.h"
#include "core/media/fog.h"
#include "core/media/medium_stack.h"
#include "core/samplers/path_sampler.h"
#include "core/scene/solids.h"

namespace core {

/// Maximum number of null scatterings (holes, clear surfaces) along a path or shadow ray; bounds
/// paths that hit nothing else.
inline constexpr int kNullScatteringMax = 4096;

/// How much a rough surface widens the ray cone [rad], relative to its GGX width.
inline constexpr float kConeSpreadOfWidth = 0.1F;

/// Returns whether scattering of this density of direction [1/sr] is about as sharp as a mirror's:
/// thirty times that of diffuse scattering.
inline bool is_sharp_density(double pdf_solid_angle) noexcept { return pdf_solid_angle >= 10; }

/// The last scattering event, which MIS needs when the current segment hits an emitter.
struct LastScattering {
  float pdf_bsdf = 0;       ///< solid-angle density of the direction [1/sr]; 0: camera or delta
  Vec3 origin;              ///< where the segment began, world [m]
  Vec3 light_normal;        ///< as passed to the light sampler there
  float light_samples = 1;  ///< number taken there: the n of the MIS weights

  bool is_sharp() const noexcept {
    return pdf_bsdf == 0 || is_sharp_density(static_cast<double>(pdf_bsdf));
  }
};

struct PathState {
  PathSampler sampler;       ///< started for the pixel and sample
  std::uint64_t& rays;       ///< adds the rays traced
  Ray ray{};                 ///< direction is unit
  Rgb beta = {1, 1, 1};      ///< throughput: BSDF, cosine and transmittance over density
  int depth = 0;             ///< surfaces hit plus scatterings in media; selects the random numbers
  int null_scatterings = 0;  ///< of `depth`: clear surfaces passed without a change of direction
  LastScattering last{};
  float eta_scale =
      1;  ///< product of eta^2 over refractions; removes the n^2 of radiance from roulette
  float cone_width_m = 0;  ///< ray cone at the origin of the segment
  float cone_spread_rad = 0;
  bool is_sharp = true;      ///< no rough surface so far: textures are filtered as for camera rays
  bool passed_hole = false;  ///< on the current segment
  bool is_from_light = false;   ///< carries power from a light, not importance from the camera
  bool is_clear = false;        ///< has only passed clear surfaces (core/transport/vertex.h) so far
  const RawHit* met = nullptr;  ///< the end of the current segment, if already known
  MediumStack media{};          ///< the solids that contain the current segment
  std::uint32_t solid_holes = 0;  ///< holes in solids that the current segment has passed
  float passed_m = 0;             ///< length of the segment up to the last of them
  std::uint32_t alpha_tests = 0;  ///< random numbers drawn for holes at this depth
  float wavelength_nm = 0;        ///< hero wavelength; 0: the path carries all of them
  /// The number of its hero wavelength, if paths share one; their throughput then leaves out its
  /// colour. Negative: the path draws its own.
  float u_wavelength = -1;
  int medium_scatterings = 0;  ///< of `depth`: those in media
  const Fog* fog = nullptr;    ///< around the solids; null if there is none

  /// Scattering events at surfaces.
  int scatterings() const noexcept { return depth - null_scatterings - medium_scatterings; }
  /// Scattering events at surfaces and in media.
  int bounces() const noexcept { return depth - null_scatterings; }
  Footprint footprint() const noexcept { return {cone_width_m, is_sharp}; }
};

/// Returns a path without a ray, in no solid.
inline PathState start_path(const PathSampler& sampler, std::uint64_t& rays) noexcept {
  return PathState{.sampler = sampler, .rays = rays};
}

/// Returns a path that starts at the camera, in the solids around it.
inline PathState start_path(const SceneData& scene, const Camera::CameraRay& camera_ray,
                            const PathSampler& sampler, std::uint64_t& rays) noexcept {
  PathState path = start_path(sampler, rays);
  if (const StartMedia* start = camera_ray.start; start != nullptr) {
    path.media = start->varies ? solids_around(scene, camera_ray.ray.origin, camera_ray.ray.time)
                               : start->media;
  }
  path.ray = camera_ray.ray;
  path.cone_width_m = camera_ray.width_m;
  path.cone_spread_rad = camera_ray.spread_rad;
  path.is_clear = true;
  return path;
}

}  // namespace core
