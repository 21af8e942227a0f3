/// Parses glTF JSON and refuses whatever does not fit the schemas, or points outside of what it
/// points into, before any other code reads the file.
#pragma once

#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/scene_io/gltf_container.h"
#include "core/scene_io/gltf_tables.h"

namespace core {

struct CheckedGltf {
  GltfTables tables;
  /// The document for tinygltf. It holds no buffers and no images, and stubs for views and
  /// accessors: what those name is in `tables`, checked, and tinygltf over-reads on bad ones.
  std::string model_json;
  std::vector<std::string> warnings;
};

/// Pre: open_container() has looked at the nesting. Errors: kInvalidArgument with a JSON pointer.
Result<CheckedGltf> check_gltf(const GltfContainer& container);

}  // namespace core
