/// Validates a glTF document against the schemas.
#pragma once

#include <string>

#include "core/base/result.h"
#include "core/scene_io/gltf_json.h"

namespace core {

/// Converts integers written as 5.0 to 5. Errors: kInvalidArgument with a JSON pointer.
Status check_schemas(GltfJson& root);

/// Returns a value as quoted in messages: its JSON, shortened if long.
std::string shown(const GltfJson& value);

}  // namespace core
