/// PathState: a path under construction, from one vertex to the next.
///
/// Source of the loop that uses it: PBR 4th ed., section 14.1.
#pragma once

#include <cstdint>

#include "core/accel/accel.h"
#include "core/camera/camera.h"
#include "core/materials/shade.h"
#include "core/media/fog.h"
#include "core/samplers/path_sampler.h"
#include "core/transport/medium_stack.h"

namespace core {

/// Most surfaces without scattering (holes, clear surfaces) along one path or shadow ray; bounds
/// paths that meet nothing else.
inline constexpr int kNullScatteringMax = 4096;

/// Direction and origin of the current ray segment, as MIS needs them where it meets an emitter.
struct LastScattering {
  float pdf_bsdf = 0;       ///< solid-angle density of the direction [1/sr]; 0: camera or delta
  Vec3 origin;              ///< where the segment began, world [m]
  Vec3 light_normal;        ///< as given to the light sampler there
  float light_samples = 1;  ///< taken there: the count n in the weights of MIS
};

struct PathState {
  PathSampler sampler;   ///< started for the pixel and sample
  std::uint64_t& rays;   ///< counts the rays traced
  Ray ray{};             ///< direction is unit
  Rgb beta = {1, 1, 1};  ///< throughput: BSDF, cosine and transmittance over density
  int depth = 0;         ///< surfaces met and scatterings in media so far; names the random numbers
  int null_scatterings = 0;  ///< of these, clear surfaces passed without a change of direction
  LastScattering last{};
  float eta_scale =
      1;  ///< product of eta^2 over refractions: takes n^2 of radiance out of roulette
  float cone_width_m = 0;  ///< ray cone at the origin of the segment
  float cone_spread_rad = 0;
  bool is_sharp = true;         ///< no rough surface so far: textures are filtered as at first hits
  bool passed_hole = false;     ///< on the current segment
  const RawHit* met = nullptr;  ///< at the end of the current segment, if that is known already
  MediumStack media{};          ///< the solids around the current segment
  std::uint32_t alpha_tests = 0;  ///< random numbers drawn for holes so far
  float wavelength_nm = 0;        ///< hero wavelength; 0: the path carries all of them
  int medium_scatterings = 0;     ///< of `depth`, those within media
  const Fog* fog = nullptr;       ///< around the solids; null: there is none

  /// At surfaces.
  int scatterings() const noexcept { return depth - null_scatterings - medium_scatterings; }
  /// Everywhere.
  int bounces() const noexcept { return depth - null_scatterings; }
  Footprint footprint() const noexcept { return {cone_width_m, is_sharp}; }
};

/// A path that begins at the camera.
inline PathState start_path(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                            std::uint64_t& rays) noexcept {
  PathState path{.sampler = sampler, .rays = rays};
  path.ray = camera_ray.ray;
  path.cone_width_m = camera_ray.width_m;
  path.cone_spread_rad = camera_ray.spread_rad;
  return path;
}

}  // namespace core
