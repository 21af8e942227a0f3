/// Triangle meshes in memory, and where they are placed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/description/moved_vertices.h"
#include "core/math/transform.h"
#include "core/math/vec.h"

namespace core {

/// One mesh primitive in memory. Buffers belong to Embree too.
struct MeshData {
  std::vector<Vec3> positions;  ///< one more than there are vertices: Embree reads past the end
  std::vector<std::uint32_t> indices;
  std::vector<Vec3> normals;
  std::vector<Vec4> tangents;
  std::array<std::vector<Vec2>, 2> uv;
  std::vector<Vec4> colors;
  std::vector<std::uint32_t> file_vertices;  ///< as PrimitiveDescription has them
  std::uint32_t material = 0;
  std::uint32_t primitive = 0;  ///< PrimitiveDescription::id
  bool in_world_space = false;
  /// Of a mesh in world space that moves while the shutter is open: evenly spaced times until 1,
  /// padded as `positions` is. Rays of time 0 meet the mesh itself.
  std::vector<MovedVertices> later;

  std::size_t triangle_count() const noexcept { return indices.size() / 3; }
  std::size_t bytes() const noexcept;
};

inline constexpr std::uint32_t kNoLight = 0xffffffffU;

/// A mesh where a ray can meet it: in the top level, or through an instance.
struct PlacedMesh {
  std::uint32_t mesh = 0;
  std::uint32_t first_light = kNoLight;  ///< light of triangle 0; the others follow
  std::uint32_t group = 0;               ///< SceneData::light_groups
  std::uint32_t object = 0;              ///< ObjectDescription::id
  std::uint32_t instance = 0;
};

struct PlacedInstance {
  Transform to_world;
  std::uint32_t first_placed = 0;  ///< into placed; geometry g of the group is placed[first + g]
};

}  // namespace core
