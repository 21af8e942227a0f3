/// Walks the placed meshes of a scene, bounds the error of their triangles, and boxes them.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/geometry/triangle_math.h"
#include "core/math/bounds.h"
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

/// Returns the box around the vertices of a mesh, in its space.
inline Bounds bounds_of(const MeshData& mesh) {
  Bounds out;
  for (std::size_t i = 0; i + 1 < mesh.positions.size(); ++i) {
    out.add(mesh.positions[i]);
  }
  return out;
}

/// Returns the box around the image of a box.
inline Bounds image_of(const Bounds& box, const Transform& map) {
  Bounds out;
  for (unsigned corner = 0; corner < 8 && !box.empty(); ++corner) {
    out.add(map.point({(corner & 1U) != 0 ? box.max.x : box.min.x,
                       (corner & 2U) != 0 ? box.max.y : box.min.y,
                       (corner & 4U) != 0 ? box.max.z : box.min.z}));
  }
  return out;
}

inline bool meet(const Bounds& a, const Bounds& b) {
  return a.min.x <= b.max.x && b.min.x <= a.max.x && a.min.y <= b.max.y && b.min.y <= a.max.y &&
         a.min.z <= b.max.z && b.min.z <= a.max.z;
}

}  // namespace core
