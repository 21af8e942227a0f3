/// The random numbers of a path by use. They come in groups of four, which are stratified together.
///
/// tests/tidy compares this table with the sources: no number has two uses, and each file draws
/// from exactly the groups that list it.
///
///   group   number  use                                   drawn in
///   camera  x y     position on the film                  camera_sample wave_tracer mlt census
///                                                         cached_irradiance
///   camera  z w     position on the lens                  camera_sample wave_tracer mlt census
///                                                         cached_irradiance
///   light   x       which light                           path direct_light bdpt irradiance
///                                                         shared_lights path_media wave_tracer
///                                                         lane_fog
///   light   y z     where on it                           path direct_light bdpt irradiance
///                                                         shared_lights path_media wave_tracer
///                                                         lane_fog
///   light   w       Russian roulette of the path          path bdpt shared_lights path_media
///                                                         wave_tracer lane_fog
///   bsdf    x       which lobe                            path direct light_path bdpt light_trace
///                                                         photon_mapping catcher census
///                                                         wave_tracer feature_pass
///   bsdf    y z     direction                             path direct light_path bdpt irradiance
///                                                         light_trace photon_mapping
///                                                         cached_irradiance catcher census
///                                                         path_media wave_tracer lane_fog
///                                                         feature_pass
///   bsdf    w       delta lobe or not, where directions   path
///                   do not follow the BSDF
///   volume  x       which channel's extinction            medium_sample lane_fog
///   volume  y       how far within a medium               medium_sample lane_fog
///   volume  z       wavelengths of a spectral path        path wave_tracer
///   volume  w       hero wavelength                       surface_event scene_colors bdpt
///   choice  x       which of several light candidates,    path shared_lights catcher
///                   or a turn of a softened shadow        lane_shadows
///   choice  y       Russian roulette of the shadow ray,   path catcher
///                   or that turn
///   choice  z       which of the shared light samples,    shared_lights catcher
///                   or the turn of a direction's shadow
///   choice  w       whether the light tree is asked for   shared_lights catcher
///                   the density of a neighbour's sample,
///                   or that turn
///   start   x       which light a light path starts at    light_path
///   start   y z     where on it                           light_path
///   start   w       which share of the light a particle   census
///                   of a census counts, in a tile
///   aim     x y     its direction                         light_path
///   aim     z       the same in the picture               census
///   vertex  x y     position on the lens                  light_trace bdpt
///   vertex  z       Russian roulette of a light path      light_path bdpt
///   stretch x       which light, for a stretch of medium  path_media
///   stretch y z     where on it                           path_media
///   stretch w       how far along the stretch             path_media
///   time    x       when within the open shutter          renderer feature_pass
///                                                         wave_tracer
///   extra   0..     holes along a segment                 intersect visibility wave_tracer
///   extra   2^30..  volume x and y, behind holes in       medium_sample
///                   solids
///   extra   2^31..  analog absorption                     path
#pragma once

namespace core {

inline constexpr int kCameraGroup = 0;

/// Selects the point and direction at which a light path starts.
inline constexpr int kStartGroup = 2 << 20;
inline constexpr int kAimGroup = kStartGroup + 1;

/// Every bounce has a block of groups of fixed size, so that a new use does not shift the others.
enum class BounceGroup { kLight, kBsdf, kVolume, kCount };

constexpr int dimension_group(int bounce, BounceGroup group) {
  return 1 + bounce * static_cast<int>(BounceGroup::kCount) + static_cast<int>(group);
}

/// Returns whether it is the group "bsdf" of a bounce, in which y and z form a pair.
constexpr bool is_of_bsdf(int group) {
  constexpr int kCount = static_cast<int>(BounceGroup::kCount);
  return group < (1 << 20) && (group + kCount - 1) % kCount == static_cast<int>(BounceGroup::kBsdf);
}

/// The group "choice": beyond the blocks of the deepest bounce.
constexpr int choice_group(int bounce) { return (1 << 20) + bounce; }

/// The group "vertex" of a light path, beyond its start.
constexpr int vertex_group(int bounce) { return (3 << 20) + bounce; }

/// The group "stretch" of a path's segment in a medium.
constexpr int stretch_group(int bounce) { return (4 << 20) + bounce; }

/// The group "time" of a path, while the shutter is open.
inline constexpr int kTimeGroup = 5 << 20;

}  // namespace core
