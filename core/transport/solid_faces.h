/// Surfaces of solids, with what coincides with them.
#pragma once

#include <optional>

#include "core/scene/scene_data.h"

namespace core {

/// What is at a hit, and the solids behind it.
struct FacesAt {
  MediumStack beyond;
  /// An opaque surface, or a face of a solid on a hole, at the same place: it is hit instead.
  std::optional<RawHit> instead;
  float error_m = 0;  ///< step over all of them (SurfacePoint::error_m)
};

/// Faces that coincide up to rounding are one interface: the step of rays off the surface is over
/// all of them, so that a ray that passes meets none of the others. An opaque surface there hides
/// them. point: of `hit`, which `ray` hits. media: before it.
FacesAt faces_at(const SceneData& scene, const RawHit& hit, const SurfacePoint& point,
                 const Ray& ray, const MediumStack& media) noexcept;

/// Enters a solid that a path in none meets from inside: it came through a border or an edge.
void enter_late(MediumStack& media, const Solid& solid, const SurfacePoint& point,
                const Ray& ray) noexcept;

}  // namespace core
