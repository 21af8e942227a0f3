/// Triangle meshes in memory, and their placement.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/description/moved_vertices.h"
#include "core/geometry/triangle_math.h"
#include "core/math/offset_ray.h"
#include "core/math/transform.h"
#include "core/math/vec.h"

namespace core {

/// A vertex within a triangle of the file: the sum of vertices times weights.
struct AddedVertex {
  std::array<std::uint32_t, 3> vertices = {};
  std::array<float, 3> weights = {};
};

/// One mesh primitive in memory. Embree uses its buffers directly.
struct MeshData {
  std::vector<Vec3> positions;  ///< one more than the vertex count: Embree reads past the end
  std::vector<std::uint32_t> indices;
  std::vector<Vec3> normals;  ///< padded in the same way unless empty
  std::vector<Vec4> tangents;
  int tangent_uv_set = -1;  ///< as in PrimitiveDescription
  std::array<std::vector<Vec2>, 2> uv;
  std::vector<Vec4> colors;
  std::vector<std::uint32_t> file_vertices;  ///< as in PrimitiveDescription
  std::vector<AddedVertex> added;            ///< the last vertices, which are not of the file
  /// By triangle: bit 0 if rays may leave its front from the smooth surface of its normals, bit 1
  /// the back (core/scene/round_facets.h); empty: none.
  std::vector<std::uint8_t> round_sides;
  std::uint32_t material = 0;
  std::uint32_t primitive = 0;  ///< PrimitiveDescription::id
  bool in_world_space = false;
  /// Positions of a world-space mesh that moves while the shutter is open, at evenly spaced times
  /// up to 1, padded like `positions`. Rays at time 0 hit the mesh itself.
  std::vector<MovedVertices> later;

  /// Returns a member of a vertex, which is `first` at time 0: as Embree, linear between times.
  /// Pre: the mesh moves.
  Vec3 at_time(std::vector<Vec3> MovedVertices::*member, Vec3 first, std::uint32_t vertex,
               float time) const noexcept {
    const float at = time * static_cast<float>(later.size());
    const std::size_t step = std::min(static_cast<std::size_t>(at), later.size() - 1);
    const float part = at - static_cast<float>(step);
    const Vec3 from = step == 0 ? first : (later[step - 1].*member)[vertex];
    return from * (1 - part) + (later[step].*member)[vertex] * part;
  }
  Vec3 position(std::uint32_t vertex, float time) const noexcept {
    const Vec3 p = positions[vertex];
    return later.empty() ? p : at_time(&MovedVertices::positions, p, vertex, time);
  }
  bool is_round(std::uint32_t triangle, bool front) const noexcept {
    return !round_sides.empty() && (round_sides[triangle] >> (front ? 0 : 1) & 1) != 0;
  }
  std::size_t triangle_count() const noexcept { return indices.size() / 3; }
  std::size_t bytes() const noexcept;
};

/// A mesh in world space at a time.
struct MeshAt {
  const MeshData& mesh;
  const Transform* to_world;  ///< null: the mesh is in world space; else it does not move
  float time;

  /// Returns whether it differs from the mesh itself.
  bool is_moved() const noexcept { return to_world != nullptr || !mesh.later.empty(); }
  Vec3 position(std::uint32_t vertex) const noexcept {
    return to_world == nullptr ? mesh.position(vertex, time)
                               : to_world->point(mesh.positions[vertex]);
  }
  /// Not normalised if the mesh is moved. Pre: the mesh has normals.
  Vec3 normal(std::uint32_t vertex) const noexcept {
    const Vec3 n = mesh.normals[vertex];
    return to_world != nullptr   ? to_world->normal(n)
           : !mesh.later.empty() ? mesh.at_time(&MovedVertices::normals, n, vertex, time)
                                 : n;
  }
  /// Returns a vector of the triangle with these vertices.
  Vec3 vector(Vec3 way, const std::uint32_t* v) const noexcept {
    if (to_world != nullptr) {
      return to_world->vector(way);
    }
    const Corners<Vec3> first = {mesh.positions[v[0]], mesh.positions[v[1]], mesh.positions[v[2]]};
    return mesh.later.empty() ? way : carried(way, first, corners(v));
  }
  Corners<Vec3> corners(const std::uint32_t* v) const noexcept {
    return {position(v[0]), position(v[1]), position(v[2])};
  }
};

inline constexpr std::uint32_t kNoLight = 0xffffffffU;
inline constexpr std::uint32_t kNoSolid = 0xffffffffU;

/// A mesh that rays can hit: in the top level, or through an instance.
struct PlacedMesh {
  std::uint32_t mesh = 0;
  std::uint32_t first_light = kNoLight;  ///< light of triangle 0; those of the other triangles
                                         ///< follow
  std::uint32_t group = 0;               ///< index into SceneData::light_groups
  std::uint32_t object = 0;              ///< ObjectDescription::id
  std::uint32_t instance = 0;
  std::uint32_t solid = kNoSolid;  ///< index into SceneData::solids
};

struct PlacedInstance {
  Transform to_world;
  std::uint32_t first_placed = 0;  ///< into `placed`; geometry g of the group is placed[first + g]
  InstanceError error;
};

}  // namespace core
