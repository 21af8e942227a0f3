/// Parses glTF JSON, and mends or refuses anything that does not fit the schemas or refers out of
/// range, before other code reads the file.
#pragma once

#include <string>

#include "core/base/result.h"
#include "core/scene_io/gltf_container.h"
#include "core/scene_io/gltf_repairs.h"
#include "core/scene_io/gltf_tables.h"

namespace core {

struct CheckedGltf {
  GltfTables tables;
  /// The document for tinygltf. It has no buffers and images, and stubs for views and accessors,
  /// because tinygltf reads out of bounds on invalid ones; `tables` has the checked content.
  std::string model_json;
};

/// Pre: open_container() has checked the nesting. Errors: kInvalidArgument with a JSON pointer.
Result<CheckedGltf> check_gltf(const GltfContainer& container, GltfRepairs& repairs);

}  // namespace core
