/// Meshes of a scene: shared between nodes with equal use, separate if weights or joints differ.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "core/base/result.h"
#include "core/description/scene_description.h"
#include "core/scene_io/gltf_load.h"
#include "core/scene_io/gltf_primitive.h"
#include "core/scene_io/gltf_source.h"
#include "core/scene_io/tinygltf.h"

namespace core {

/// Key of a mesh instance: distinguishes uses of a mesh.
struct MeshUse {
  int mesh = -1;
  std::vector<float> weights;                 ///< of the morph targets; empty: none
  int node = -1;                              ///< set if the vertices are moved to world space
  std::uint32_t copy = 0;                     ///< of the node's instances, if its own transform is
  std::span<const Transform> joint_matrices;  ///< of the skin; `node` is then set
  const Transform* baked = nullptr;           ///< a singular transform to apply; `node` is then set
};

class GltfMeshes {
 public:
  /// variant: index into KHR_materials_variants, -1 for none. All references must outlive it. Pre:
  /// scene.mesh_primitives is filled.
  GltfMeshes(const tinygltf::Model& model, GltfSource& source, const GltfOptions& options,
             int variant, GltfRepairs& repairs, SceneDescription& scene)
      : model_(model),
        source_(source),
        limits_(options.limits),
        has_tangents_(!options.geometry_only),
        variant_(variant),
        repairs_(repairs),
        scene_(scene) {}

  /// Returns the index into scene.meshes, creating the mesh on first use; -1 if nothing of it can
  /// be drawn.
  Result<int> mesh_for(const MeshUse& use);

 private:
  struct Part {
    std::uint32_t number = 0;  ///< in the mesh
    std::string where;
    GltfPrimitive primitive;
  };

  Result<int> make(const MeshUse& use);
  /// Reads the primitives of a mesh that can be drawn.
  Result<std::vector<Part>> read_parts(int mesh);
  /// Notes texture coordinates that its material needs and that it does not have.
  Status check_coordinates(const PrimitiveDescription& base, const std::string& where);
  /// Turns triangles of solids, and then normals, to the side that is right.
  void turn_sides(std::vector<Part>& parts, const std::string& mesh);
  /// Moves the vertices by morph targets, skin or a singular transform.
  Status place(GltfPrimitive& primitive, const MeshUse& use, const std::string& where);
  int material_of(const tinygltf::Primitive& primitive) const;
  void finish(GltfPrimitive& primitive) const;
  void note_turned(const GltfPrimitive& primitive, const std::string& mesh,
                   const std::string& where);
  /// Takes out the triangles that repeat others in the opposite winding, where that matters: those
  /// of a solid are left out, and those of a material that emits on one side returned.
  std::optional<PrimitiveDescription> backs_of(PrimitiveDescription& primitive,
                                               const std::string& mesh, const std::string& where);

  const tinygltf::Model& model_;
  GltfSource& source_;
  GltfLimits limits_;
  bool has_tangents_;  ///< created if materials need them
  int variant_;
  GltfRepairs& repairs_;
  SceneDescription& scene_;
  std::size_t triangles_ = 0;
  std::set<std::string> without_uv_;  ///< noted by check_coordinates()
  std::map<std::tuple<int, std::vector<float>, int, std::uint32_t>, int> known_;
};

}  // namespace core
