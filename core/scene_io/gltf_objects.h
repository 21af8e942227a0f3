/// Numbers the objects of a glTF file: nodes with meshes, their instances, and primitives.
#pragma once

#include "core/base/result.h"
#include "core/description/scene_description.h"
#include "core/scene_io/gltf_tables.h"
#include "core/scene_io/tinygltf.h"

namespace core {

/// Fills scene.objects and scene.mesh_primitives from the document alone, including nodes that are
/// hidden, in another scene, or empty at this time. Each node has its own range of instance ids.
/// Errors: kTooLarge for more instances than a float can count.
Status number_objects(const tinygltf::Model& model, const GltfTables& tables,
                      SceneDescription& scene);

}  // namespace core
