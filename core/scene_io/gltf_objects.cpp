#include "core/scene_io/gltf_objects.h"

#include <cstddef>
#include <cstdint>
#include <string>

#include "core/scene_io/gltf_model.h"

namespace core {
namespace {

/// Float images hold ids exactly up to this number.
constexpr std::uint64_t kIdMax = std::uint64_t{1} << 24U;

std::uint64_t instances_of(const tinygltf::Node& node, const GltfTables& tables) {
  const auto* extension = find_extension(node.extensions, "EXT_mesh_gpu_instancing");
  if (extension == nullptr || node.skin >= 0) {
    return 1;
  }
  const tinygltf::Value& attributes = extension->Get("attributes");
  for (const char* name : {"TRANSLATION", "ROTATION", "SCALE"}) {
    const int accessor = value_integer(attributes, name, -1);
    if (accessor >= 0 && static_cast<std::size_t>(accessor) < tables.accessors.size()) {
      return tables.accessors[static_cast<std::size_t>(accessor)].count;
    }
  }
  return 0;
}

}  // namespace

Status number_objects(const tinygltf::Model& model, const GltfTables& tables,
                      SceneDescription& scene) {
  std::uint64_t next = 1;
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    const tinygltf::Node& node = model.nodes[i];
    if (node.mesh < 0) {
      continue;
    }
    const std::string& mesh = model.meshes[static_cast<std::size_t>(node.mesh)].name;
    const std::uint64_t count = instances_of(node, tables);
    if (count >= kIdMax || next + count > kIdMax || i + 1 >= kIdMax) {
      return Error{ErrorCode::kTooLarge,
                   "the file has more than " + std::to_string(kIdMax) + " instances",
                   "/nodes/" + std::to_string(i)};
    }
    scene.objects.push_back({.id = static_cast<std::uint32_t>(i + 1),
                             .name = node.name.empty() ? mesh : node.name,
                             .first_instance = static_cast<std::uint32_t>(next),
                             .instances = static_cast<std::uint32_t>(count)});
    next += count;
  }
  for (const tinygltf::Mesh& mesh : model.meshes) {
    scene.mesh_primitives.push_back(static_cast<std::uint32_t>(mesh.primitives.size()));
  }
  return ok_status();
}

}  // namespace core
