/// visibility: how much light gets along a shadow ray.
#pragma once

#include "core/scene/scene_data.h"
#include "core/transport/path_state.h"
#include "core/transport/scene_colors.h"
#include "core/transport/vertex.h"

namespace core {

/// t_max of rays to infinity.
inline constexpr float kFar = 3.0e38F;

struct Visibility {
  Rgb transmittance;      ///< 0 behind opaque surfaces
  bool is_clear = false;  ///< nothing at all was in the way
};

/// Clear surfaces (smooth thin transmission, solids of the index around them) along a shadow ray.
enum class ClearSurfaces {
  kPass,  ///< they transmit straight on: for paths whose scatter() treats them as no vertex
  kBlock  ///< they occlude: for paths that meet them as vertices
};

/// `towards` starts inside `media`; its direction is unit and t_max kFar for infinity, else its
/// direction spans to the end point and t_max is 1; its time is the path's. BLEND surfaces transmit
/// 1 - alpha, solids absorb. The cone and wavelength are the path's.
template <typename Colors = RgbColors>
Visibility visibility(const SceneData& scene, PathState& path, const Ray& towards,
                      MediumStack& media, ClearSurfaces clear = ClearSurfaces::kPass,
                      const Colors& colors = {}) noexcept;

/// Shadow ray from `vertex` to `target` (is_far: along the unit direction `wi_world` to infinity),
/// leaving on the side of the surface that wi_world points to, through the media around it.
template <typename Colors = RgbColors>
Visibility visibility_from(const SceneData& scene, PathState& path, const PathVertex& vertex,
                           Vec3 wi_world, Vec3 target, bool is_far,
                           ClearSurfaces clear = ClearSurfaces::kPass,
                           const Colors& colors = {}) noexcept;

}  // namespace core
