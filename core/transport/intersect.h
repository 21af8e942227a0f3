/// intersect: finds the next surface along a path.
#pragma once

#include "core/math/offset_ray.h"
#include "core/scene/scene_data.h"
#include "core/transport/path_state.h"
#include "core/transport/vertex.h"

namespace core {

/// Traces path.ray to the nearest surface and fills point, wo_world, distance_m and face of
/// `vertex`. Skips surfaces of solids in space that belongs to another, and holes: a surface with
/// coverage a (MASK: 0 or 1; BLEND: alpha) is hit with probability a. At holes in solids, where the
/// medium changes, it stops (face.is_hole). Returns false if the ray left the scene.
bool intersect(const SceneData& scene, PathState& path, PathVertex& vertex) noexcept;

/// Continues behind a hole in a solid.
void pass_hole(PathState& path, const PathVertex& vertex) noexcept;

/// As intersect(), passes holes in solids too, and multiplies path.beta by what the media on the
/// way let through (segment_transmittance()). For paths in media that absorb only.
bool reach(const SceneData& scene, PathState& path, PathVertex& vertex) noexcept;

/// A ray past a surface, at which it changes nothing.
inline Ray ray_behind(const SurfacePoint& point, const Ray& ray) noexcept {
  Ray out = ray;
  out.origin = origin_behind(point.position, point.normal_geometric, point.error_m, ray.direction);
  return out;
}

/// Returns the random number of hole `index` along a segment. The first four are stratified over a
/// pixel's samples.
inline float hole_number(const PathSampler& sampler, int bounce, std::uint32_t index) noexcept {
  if (index >= 4) {
    return sampler.extra_1d(bounce, index);
  }
  const Vec4 u = sampler.get_4d(hole_group(bounce));
  return index == 0 ? u.x : index == 1 ? u.y : index == 2 ? u.z : u.w;
}

/// Returns whether a ray passes a surface with this coverage by a hole. draw(): the random number
/// of the hit, drawn only where both are possible.
template <typename Draw>
bool passes_hole(float coverage, Draw&& draw) noexcept {
  return coverage < 1 && !(coverage > 0 && draw() < coverage);
}

}  // namespace core
