/// visibility: traces shadow rays.
#pragma once

#include "core/scene/scene_data.h"
#include "core/transport/path_state.h"
#include "core/transport/scene_colors.h"
#include "core/transport/vertex.h"

namespace core {

/// t_max of rays to infinity.
inline constexpr float kFar = 3.0e38F;

struct Visibility {
  Rgb transmittance;      ///< 0 if an opaque surface occludes
  bool is_clear = false;  ///< the ray hit no surface at all
};

/// Treatment of clear surfaces (smooth thin transmission, or solids with the index of their
/// surroundings) along a shadow ray.
enum class ClearSurfaces {
  kPass,  ///< transmit without deflection: for paths whose scatter() does not treat them as
          ///< vertices
  kBlock  ///< occlude: for paths that treat them as vertices
};

/// Traces the shadow ray `towards`, which starts inside `media`. To infinity: its direction is unit
/// and t_max is kFar; else its direction spans to the end point and t_max is 1. Its time is the
/// path's. BLEND surfaces transmit 1 - alpha; solids absorb. The cone and wavelength are the
/// path's.
template <typename Colors = RgbColors>
Visibility visibility(const SceneData& scene, PathState& path, const Ray& towards,
                      MediumStack& media, ClearSurfaces clear = ClearSurfaces::kPass,
                      const Colors& colors = {}) noexcept;

/// Traces a shadow ray from `vertex` to `target` (is_far: to infinity along the unit direction
/// `wi_world`), starting on the side of the surface that wi_world points to, through the media
/// there.
template <typename Colors = RgbColors>
Visibility visibility_from(const SceneData& scene, PathState& path, const PathVertex& vertex,
                           Vec3 wi_world, Vec3 target, bool is_far,
                           ClearSurfaces clear = ClearSurfaces::kPass,
                           const Colors& colors = {}) noexcept;

}  // namespace core
