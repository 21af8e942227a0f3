/// Meshes of a scene: shared where nodes show them alike, separate where weights or joints differ.
#pragma once

#include <map>
#include <span>
#include <tuple>
#include <vector>

#include "core/base/result.h"
#include "core/description/scene_description.h"
#include "core/scene_io/gltf_load.h"
#include "core/scene_io/gltf_source.h"
#include "core/scene_io/tinygltf.h"

namespace core {

/// Key of a mesh instance: what distinguishes two uses of a mesh.
struct MeshUse {
  int mesh = -1;
  std::vector<float> weights;                 ///< of the morph targets; empty: none
  int node = -1;                              ///< set when the vertices are moved to the world
  std::span<const Transform> joint_matrices;  ///< of the skin; then node is set
  const Transform* baked = nullptr;           ///< a singular transform to apply; then node is set
};

class GltfMeshes {
 public:
  /// variant: index into KHR_materials_variants, -1 for none. All references outlive this.
  /// Pre: scene.mesh_primitives are there.
  GltfMeshes(const tinygltf::Model& model, GltfSource& source, const GltfOptions& options,
             int variant, SceneDescription& scene)
      : model_(model),
        source_(source),
        limits_(options.limits),
        has_tangents_(!options.geometry_only),
        variant_(variant),
        scene_(scene) {}

  /// Index into scene.meshes, made on first use; -1 when nothing of the mesh can be drawn.
  Result<int> mesh_for(const MeshUse& use);

 private:
  Result<int> make(const MeshUse& use);
  int material_of(const tinygltf::Primitive& primitive) const;
  void finish(PrimitiveDescription& primitive) const;

  const tinygltf::Model& model_;
  GltfSource& source_;
  GltfLimits limits_;
  bool has_tangents_;  ///< made where materials need them
  int variant_;
  SceneDescription& scene_;
  std::size_t triangles_ = 0;
  std::map<std::tuple<int, std::vector<float>, int>, int> known_;
};

}  // namespace core
