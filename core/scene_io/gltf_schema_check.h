/// Compares a glTF document with the schemas.
#pragma once

#include <string>

#include "core/base/result.h"
#include "core/scene_io/gltf_json.h"

namespace core {

/// Integers that are written as 5.0 become 5 on the way. Errors: kInvalidArgument with a JSON
/// pointer.
Status check_schemas(GltfJson& root);

/// A value as messages quote it: its JSON, cut where it is long.
std::string shown(const GltfJson& value);

}  // namespace core
