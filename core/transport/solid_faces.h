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
  /// The solid of the hit begins and ends here, as a film that is thinner than the errors: it is
  /// not crossed.
  bool has_both_ways = false;
};

/// Faces that coincide up to rounding are one interface: the step of rays off the surface is over
/// all of them, so that a ray that passes meets none of the others. An opaque surface there hides
/// them. point: of `hit`, which `ray` hits. media: before it.
FacesAt faces_at(const SceneData& scene, const RawHit& hit, const SurfacePoint& point,
                 const Ray& ray, const MediumStack& media) noexcept;

/// Enters a solid that a path in none meets from inside: it came through a border or an edge.
/// faces: at the hit; they are the same before and after.
void enter_late(MediumStack& media, const Solid& solid, const FacesAt& faces,
                const SurfacePoint& point, const Ray& ray) noexcept;

}  // namespace core
