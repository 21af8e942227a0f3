/// Validates a glTF document against the schemas.
#pragma once

#include <string>

#include "core/base/result.h"
#include "core/scene_io/gltf_json.h"
#include "core/scene_io/gltf_repairs.h"
#include "core/scene_io/gltf_tables.h"

namespace core {

/// Converts integers written as 5.0 to 5, mends values as their rows say, and fills tables.used and
/// tables.left_out. A part that nothing uses is left out if it has a fault; so are accessors,
/// views, images and cameras, which are refused only where they are read, and animations. Errors:
/// kInvalidArgument with a JSON pointer.
Status check_schemas(GltfJson& root, GltfTables& tables, GltfRepairs& repairs);

/// Returns a value as quoted in messages: its JSON, shortened if long.
std::string shown(const GltfJson& value);

}  // namespace core
