/// Places the meshes, lights and cameras of a scene's nodes in the world.
#pragma once

#include "core/base/result.h"
#include "core/description/scene_description.h"
#include "core/scene_io/gltf_animation.h"
#include "core/scene_io/gltf_load.h"
#include "core/scene_io/gltf_meshes.h"
#include "core/scene_io/gltf_source.h"
#include "core/scene_io/tinygltf.h"

namespace core {

/// Fills scene.instances, lights and cameras. Pre: scene.objects is filled. Errors:
/// kInvalidArgument, kTooLarge with a pointer.
Status place_nodes(const tinygltf::Model& model, GltfSource& source, GltfMeshes& meshes,
                   const GltfOptions& options, const AnimatedNodes& animated,
                   SceneDescription& scene);

}  // namespace core
