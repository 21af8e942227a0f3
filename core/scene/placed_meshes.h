/// Walks the placed meshes of a scene, and bounds the error of their triangles.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/geometry/triangle_math.h"
#include "core/math/offset_ray.h"
#include "core/scene/scene_data.h"

namespace core {

/// Calls visit(placed, instance, geometry) for each placed mesh in order; the last two are those of
/// its hits.
template <typename Visit>
void for_each_placed(const SceneData& scene, Visit&& visit) {
  std::size_t begun = 0;  // instances whose meshes begin at or before `placed`
  for (std::uint32_t placed = 0; placed < scene.placed.size(); ++placed) {
    while (begun < scene.instances.size() && scene.instances[begun].first_placed <= placed) {
      ++begun;
    }
    if (begun == 0) {
      visit(placed, kNoInstance, placed);
    } else {
      visit(placed, static_cast<std::uint32_t>(begun - 1),
            placed - scene.instances[begun - 1].first_placed);
    }
  }
}

/// Returns the largest plane_error_m() of a triangle's corners.
inline float face_error_m(const Corners<Vec3>& p, float twice_area, InstanceError instance) {
  float out = 0;
  for (const Vec3 corner : p) {
    out = std::max(out, plane_error_m(corner, p[1] - p[0], p[2] - p[0], twice_area, instance));
  }
  return out;
}

}  // namespace core
