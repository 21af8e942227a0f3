/// The random numbers of a path by use. They come in groups of four, which are stratified together.
///
/// tests/tidy compares this table with the sources: no number has two uses, and each file draws
/// from exactly the groups that list it.
///
///   group   number  use                                   drawn in
///   camera  x y     position on the film                  film/camera_sample wave/wave_tracer
///                                                         integrators/mlt integrators/census
///                                                         integrators/cached_irradiance
///   camera  z w     position on the lens                  film/camera_sample wave/wave_tracer
///                                                         integrators/mlt integrators/census
///                                                         integrators/cached_irradiance
///   light   x       which light                           integrators/path transport/direct_light
///                                                         integrators/bdpt integrators/irradiance
///                                                         integrators/shared_lights
///                                                         integrators/path_media wave/wave_tracer
///   light   y z     where on it                           integrators/path transport/direct_light
///                                                         integrators/bdpt integrators/irradiance
///                                                         integrators/shared_lights
///                                                         integrators/path_media wave/wave_tracer
///   light   w       Russian roulette of the path          integrators/path integrators/bdpt
///                                                         integrators/shared_lights
///                                                         integrators/path_media
///                                                         wave/wave_tracer
///   bsdf    x       which lobe                            integrators/path integrators/direct
///                                                         transport/light_path integrators/bdpt
///                                                         integrators/light_trace
///                                                         integrators/photon_mapping
///                                                         integrators/catcher integrators/census
///                                                         wave/wave_tracer render/feature_pass
///   bsdf    y z     direction                             integrators/path integrators/direct
///                                                         transport/light_path integrators/bdpt
///                                                         integrators/irradiance
///                                                         integrators/light_trace
///                                                         integrators/photon_mapping
///                                                         integrators/cached_irradiance
///                                                         integrators/catcher integrators/census
///                                                         integrators/path_media
///                                                         wave/wave_tracer render/feature_pass
///   bsdf    w       delta lobe or not, where directions   integrators/path
///                   do not follow the BSDF
///   volume  x       which channel's extinction            transport/medium_sample
///   volume  y       how far within a medium               transport/medium_sample
///   volume  z       wavelengths of a spectral path        integrators/path
///   volume  w       hero wavelength                       transport/surface_event
///                                                         transport/scene_colors
///                                                         integrators/bdpt
///   choice  x       which of several light candidates,    integrators/path
///                   or a turn of a softened shadow        integrators/shared_lights
///                                                         integrators/catcher
///   choice  y       Russian roulette of the shadow ray,   integrators/path
///                   or that turn                          integrators/catcher
///   choice  z       which of the shared light samples,    integrators/shared_lights
///                   or the turn of a direction's shadow   integrators/catcher
///   choice  w       whether the light tree is asked for   integrators/shared_lights
///                   the density of a neighbour's sample,  integrators/catcher
///                   or that turn
///   start   x       which light a light path starts at    transport/light_path
///   start   y z     where on it                           transport/light_path
///   start   w       which share of the light a particle   integrators/census
///                   of a census counts, in a tile
///   aim     x y     its direction                         transport/light_path
///   aim     z       the same in the picture               integrators/census
///   vertex  x y     position on the lens                  integrators/light_trace
///                                                         integrators/bdpt
///   vertex  z       Russian roulette of a light path      transport/light_path
///                                                         integrators/bdpt
///   stretch x       which light, for a stretch of medium  integrators/path_media
///   stretch y z     where on it                           integrators/path_media
///   stretch w       how far along the stretch             integrators/path_media
///   time    x       when within the open shutter          render/renderer render/feature_pass
///   extra   0..     holes along a segment                 transport/intersect
///                                                         transport/visibility
///   extra   2^30..  volume x and y, behind holes in       transport/medium_sample
///                   solids
///   extra   2^31..  analog absorption                     integrators/path
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
