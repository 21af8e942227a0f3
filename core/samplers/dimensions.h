/// The random numbers of a path by use. They come in groups of four, which are stratified together.
///
/// tests/tidy compares this table with the sources: no number has two uses, and the last column is
/// what they draw (tests/tidy/tidy_test.py --numbers writes it).
///
///   group   number  use                                   drawn in
///   camera  x y     position on the film                  cached_irradiance camera_sample census
///                                                         mlt wave_tracer
///   camera  z w     position on the lens                  cached_irradiance camera_sample census
///                                                         mlt wave_tracer
///   light   x       which light                           bdpt direct_light irradiance lane_fog
///                                                         path path_media shared_lights
///                                                         wave_tracer
///   light   y z     where on it                           bdpt direct_light irradiance lane_fog
///                                                         path path_media shared_lights
///                                                         wave_tracer
///   light   w       Russian roulette of the path          bdpt lane_fog path path_media
///                                                         shared_lights wave_tracer
///   bsdf    x       which lobe                            bdpt catcher feature_pass light_path
///                                                         path photon_mapping scatter wave_tracer
///   bsdf    y z     direction                             bdpt cached_irradiance catcher
///                                                         feature_pass irradiance lane_fog
///                                                         light_path path path_media
///                                                         photon_mapping scatter wave_tracer
///   bsdf    w       delta lobe or not, where directions   path
///                   do not follow the BSDF
///   volume  x       which channel's extinction            lane_fog medium_sample
///   volume  y       how far within a medium               lane_fog medium_sample
///   volume  z       wavelengths of a spectral path        path wave_tracer
///   volume  w       hero wavelength                       bdpt scene_colors surface_event
///   choice  x       which of several light candidates,    catcher lane_shadows path shared_lights
///                   or a turn of a softened shadow
///   choice  y       Russian roulette of the shadow ray,   catcher path
///                   or that turn
///   choice  z       which of the shared light samples,    catcher shared_lights
///                   or the turn of a direction's shadow
///   choice  w       whether the light tree is asked for   catcher shared_lights
///                   the density of a neighbour's sample,
///                   or that turn
///   start   x       which light a light path starts at    light_path
///   start   y z     where on it                           light_path
///   start   w       which share of the light a particle   census
///                   of a census counts, in a tile
///   aim     x y     its direction                         light_path
///   aim     z       the same in the picture               census
///   vertex  x y     position on the lens                  bdpt light_trace
///   vertex  z       Russian roulette of a light path      bdpt light_path
///   stretch x       which light, for a stretch of medium  path_media
///   stretch y z     where on it                           path_media
///   stretch w       how far along the stretch             path_media
///   time    x       when within the open shutter          feature_pass renderer wave_tracer
///   hole    x y z w the first four holes along a segment  intersect
///   extra   0..     the others                            intersect
///   extra   2^29..  surface or hole of a solid, along a   visibility
///                   shadow ray
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

/// The group "hole" of a path's segment.
constexpr int hole_group(int bounce) { return (6 << 20) + bounce; }

/// The group "time" of a path, while the shutter is open.
inline constexpr int kTimeGroup = 5 << 20;

}  // namespace core
