/// KHR_animation_pointer: channels that animate a member of the document other than node
/// transforms.
///
/// Supported are the numbers of materials, cameras, meshes, nodes and lights that the schemas name,
/// and KHR_node_visibility; those of the glTF 2.0 Asset Object Model. Other targets are ignored
/// with a warning.
#pragma once

#include <span>
#include <string>

#include "core/base/result.h"
#include "core/scene_io/gltf_animation.h"
#include "core/scene_io/gltf_json.h"
#include "core/scene_io/gltf_tables.h"

namespace core {

/// Fills tables.pointers. Channels that move a node become ordinary channels in `root`, which the
/// specification defines as equivalent. Pre: check_schemas() and check_tables() accepted both.
/// Channels with a fault are ignored; strict: kInvalidArgument if a pointer refers to a missing
/// member, two ways to write a target are mixed, or the output is not valid for a boolean.
Status read_pointers(GltfJson& root, GltfTables& tables, GltfRepairs& repairs);

/// Returns the document with these values. Pre: their paths are in tables.pointers.
std::string with_values(const std::string& model_json, std::span<const AnimatedValue> values);

}  // namespace core
