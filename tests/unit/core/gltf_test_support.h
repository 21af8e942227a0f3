/// Small glTF files for tests of the loader, made with GlbWriter.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/scene_io/glb_writer.h"
#include "core/scene_io/gltf_load.h"

namespace gltf_test {

constexpr int kI8 = 5120;
constexpr int kU8 = 5121;
constexpr int kI16 = 5122;
constexpr int kU16 = 5123;
constexpr int kU32 = 5125;
constexpr int kF32 = 5126;

template <typename T>
std::span<const std::byte> bytes(const std::vector<T>& values) {
  return std::as_bytes(std::span(values));
}

template <typename T>
int accessor(core::GlbWriter& writer, const std::vector<T>& values, int type, const char* shape,
             std::size_t width, const char* more = "{}") {
  return writer.add_accessor(bytes(values), type, shape, values.size() / width, more);
}

inline const std::vector<float>& triangle_positions() {
  static const std::vector<float> positions = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  return positions;
}

inline std::string number(int value) { return std::to_string(value); }

/// Adds a mesh of one primitive with these members, and a node with it.
inline void add_primitive(core::GlbWriter& writer, const std::string& members,
                          const std::string& node = "") {
  const int mesh = writer.add("meshes", "{\"primitives\":[{" + members + "}]}");
  writer.add("nodes", "{\"mesh\":" + number(mesh) + (node.empty() ? "" : "," + node) + "}");
}

/// Adds a triangle in the plane z = 0 without indices; its primitive gets `more` members.
inline void add_triangle(core::GlbWriter& writer, const std::string& more = "",
                         const std::string& node = "") {
  const int positions = accessor(writer, triangle_positions(), kF32, "VEC3", 3);
  add_primitive(
      writer,
      "\"attributes\":{\"POSITION\":" + number(positions) + "}" + (more.empty() ? "" : "," + more),
      node);
}

/// Adds a triangle with texture coordinates.
inline void add_mapped_triangle(core::GlbWriter& writer, const std::string& more) {
  const int positions = accessor(writer, triangle_positions(), kF32, "VEC3", 3);
  const int uv = accessor(writer, std::vector<float>{0, 0, 1, 0, 0, 1}, kF32, "VEC2", 2);
  add_primitive(writer, "\"attributes\":{\"POSITION\":" + number(positions) +
                            ",\"TEXCOORD_0\":" + number(uv) + "}," + more);
}

inline core::Result<core::SceneDescription> load(const core::Bytes& file,
                                                 const core::GltfOptions& options = {}) {
  return core::load_gltf(file, nullptr, options);
}
inline core::Result<core::SceneDescription> load(core::GlbWriter& writer,
                                                 const core::GltfOptions& options = {}) {
  return load(writer.finish(), options);
}
inline core::Result<core::SceneDescription> load_json(const std::string& json,
                                                      const core::ResolveUri& resolve = nullptr) {
  return core::load_gltf(std::as_bytes(std::span(json)), resolve, {});
}

/// Loads a GLB of one triangle whose material has these members.
inline core::Result<core::SceneDescription> load_material(const std::string& members,
                                                          const core::GltfOptions& options = {}) {
  core::GlbWriter writer;
  writer.add("materials", "{" + members + "}");
  add_triangle(writer, "\"material\":0");
  return load(writer, options);
}

/// As above, without mending faults.
inline core::GltfOptions strictly(core::GltfOptions options = {}) {
  options.is_strict = true;
  return options;
}
inline core::Result<core::SceneDescription> load_strictly(core::GlbWriter& writer) {
  return load(writer, strictly());
}
inline core::Result<core::SceneDescription> load_json_strictly(
    const std::string& json, const core::ResolveUri& resolve = nullptr) {
  return core::load_gltf(std::as_bytes(std::span(json)), resolve, strictly());
}

/// Returns the only primitive of a scene; fails the test if there is none.
inline core::PrimitiveDescription only_primitive(
    const core::Result<core::SceneDescription>& scene) {
  if (!scene) {
    ADD_FAILURE() << scene.error().where << ": " << scene.error().message;
    return {};
  }
  if (scene->meshes.empty() || scene->meshes[0].primitives.empty()) {
    ADD_FAILURE() << "the scene has no primitive";
    return {};
  }
  return scene->meshes[0].primitives[0];
}

inline void expect_error_at(const core::Result<core::SceneDescription>& scene,
                            const std::string& where) {
  ASSERT_FALSE(scene.has_value());
  EXPECT_EQ(scene.error().where, where) << scene.error().message;
  EXPECT_EQ(scene.error().code, core::ErrorCode::kInvalidArgument) << scene.error().message;
}

}  // namespace gltf_test
