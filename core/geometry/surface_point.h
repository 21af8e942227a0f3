/// SurfacePoint: where a ray meets a mesh.
#pragma once

#include <array>
#include <cstdint>

#include "core/geometry/mesh.h"
#include "core/math/vec.h"

namespace core {

/// A hit point, from the vertices. World space.
struct SurfacePoint {
  Vec3 position;
  Vec3 normal_geometric;  ///< unit, on the front side (counter-clockwise)
  Vec3 normal_shading;    ///< unit, interpolated, normal map not applied
  std::array<Vec2, 2> uv;
  Vec4 color = {1, 1, 1, 1};
  bool has_color = false;
  Vec3 tangent;  ///< unit along +u of the normal map's set; zero when there is none
  float tangent_sign = 1;
  /// A way on the surface is dot(way, to_edge1) edges from vertex 0 to 1 and dot(way, to_edge2)
  /// from 0 to 2, which the uv_edges are in the sets of coordinates. Zero unless the material has a
  /// texture.
  Vec3 to_edge1;
  Vec3 to_edge2;
  std::array<Vec2, 2> uv_edge1;
  std::array<Vec2, 2> uv_edge2;
  /// Height above the triangle, on the ray's side, of the smooth surface implied by its normals;
  /// 0 where that is flat or hollow.
  float bulge_m = 0;
  std::uint32_t material = 0;
  std::uint32_t light = kNoLight;
  std::uint32_t placed = 0;  ///< which PlacedMesh
};

}  // namespace core
