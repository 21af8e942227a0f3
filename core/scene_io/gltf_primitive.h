/// Converts one glTF primitive, from accessors or Draco data, to a triangle list. Morph targets and
/// joints are kept separate.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/description/scene_description.h"
#include "core/scene_io/gltf_source.h"
#include "core/scene_io/tinygltf.h"

namespace core {

/// Differences to the base; arrays are empty or have the base's length.
struct MorphTarget {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;
  std::vector<Vec3> tangents;
  std::array<std::vector<Vec2>, 2> uv;
  std::vector<Vec4> colors;
};

/// JOINTS_n and WEIGHTS_n.
struct JointSet {
  std::vector<std::array<std::uint32_t, 4>> joints;
  std::vector<Vec4> weights;
};

struct GltfPrimitive {
  PrimitiveDescription base;  ///< material stays -1
  std::vector<MorphTarget> targets;
  std::vector<JointSet> joint_sets;
  std::size_t aligned = 0;  ///< triangles turned by align_windings()
  std::size_t turned = 0;   ///< triangles whose normals all pointed to the back, and were turned
  /// Of each vertex: whether normal maps are for the back of its triangles; empty: for no vertex.
  std::vector<bool> maps_back;
};

/// uv_sets: the TEXCOORD_n that become uv 0 and 1. Returns empty for points and lines, and for
/// primitives without a complete triangle (adds a warning). Errors at or below `where`:
/// kInvalidArgument, kTooLarge.
Result<std::optional<GltfPrimitive>> read_primitive(const tinygltf::Primitive& primitive,
                                                    GltfSource& source, const std::string& where,
                                                    std::array<int, 2> uv_sets,
                                                    GltfRepairs& repairs);

/// Turns the normals of triangles of which all three point to the back, as in mirrored exports. A
/// vertex shared with other triangles is split. Bitangents, cross(n, t) * w, stay. To be done
/// before the vertices move, so that they are the same at all times.
void turn_normals(GltfPrimitive& primitive);

}  // namespace core
