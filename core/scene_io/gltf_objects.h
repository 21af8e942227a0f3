/// Numbers what a glTF file shows: its nodes with meshes, their instances, its primitives.
#pragma once

#include "core/base/result.h"
#include "core/description/scene_description.h"
#include "core/scene_io/gltf_tables.h"
#include "core/scene_io/tinygltf.h"

namespace core {

/// Fills scene.objects and scene.mesh_primitives from the document alone: with nodes that are not
/// of this scene, or hidden, or nothing at this moment. Instances have a range of their own for
/// each node. Errors: kTooLarge, for more instances than a float counts.
Status number_objects(const tinygltf::Model& model, const GltfTables& tables,
                      SceneDescription& scene);

}  // namespace core
