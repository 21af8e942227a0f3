/// KHR_animation_pointer: channels that change a member of the document instead of a node.
///
/// What may change are the numbers of materials, cameras, meshes, nodes and lights that the schemas
/// name, and KHR_node_visibility; those of the glTF 2.0 Asset Object Model. A target that is none
/// of these is left alone with a warning.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/scene_io/gltf_animation.h"
#include "core/scene_io/gltf_json.h"
#include "core/scene_io/gltf_tables.h"

namespace core {

/// Fills tables.pointers. Channels that move a node become plain ones in `root`, which the
/// specification calls the same. Pre: check_schemas() and check_tables() accepted both.
/// Errors: kInvalidArgument where a pointer names what the document does not have, two ways to
/// write a target are mixed, or the output does not fit a boolean.
Status read_pointers(GltfJson& root, GltfTables& tables, std::vector<std::string>& warnings);

/// The document with these values in it. Pre: their paths are those of tables.pointers.
std::string with_values(const std::string& model_json, std::span<const AnimatedValue> values);

}  // namespace core
