/// SurfacePoint: a point where a ray hits a mesh.
#pragma once

#include <array>
#include <cstdint>

#include "core/geometry/mesh.h"
#include "core/math/vec.h"

namespace core {

/// A hit point computed from the vertices. World space.
struct SurfacePoint {
  Vec3 position;
  Vec3 normal_geometric;  ///< unit, on the front side (counter-clockwise)
  Vec3 normal_shading;    ///< unit, interpolated, without normal map
  std::array<Vec2, 2> uv;
  Vec4 color = {1, 1, 1, 1};
  bool has_color = false;
  Vec3 tangent;  ///< unit along +u of the set tangent_uv_set; zero if there are none
  float tangent_sign = 1;
  int tangent_uv_set = -1;  ///< as in PrimitiveDescription
  /// A displacement d on the surface is dot(d, to_edge1) edges from vertex 0 to 1 plus dot(d,
  /// to_edge2) edges from 0 to 2; uv_edge1 and uv_edge2 are these edges in texture coordinates.
  /// Zero unless the material has a texture.
  Vec3 to_edge1;
  Vec3 to_edge2;
  std::array<Vec2, 2> uv_edge1;
  std::array<Vec2, 2> uv_edge2;
  /// Height above the triangle, on the ray's side, of the smooth surface implied by its normals; 0
  /// where that is flat or concave, and where MeshData::is_round() is false.
  float bulge_m = 0;
  float error_m = 0;  ///< step off the surface (core/math/offset_ray.h)
  std::uint32_t material = 0;
  std::uint32_t light = kNoLight;
  std::uint32_t placed = 0;  ///< index of the PlacedMesh
};

}  // namespace core
