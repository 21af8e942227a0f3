/// Splits a glTF file into its JSON text and binary chunk, without copying.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "core/base/result.h"
#include "core/scene_io/gltf_load.h"

namespace core {

struct GltfContainer {
  std::string_view json;
  std::span<const std::byte> bin;  ///< of a GLB, if present
  bool has_bin = false;
};

/// Recognises GLB by its magic and JSON by its opening brace; refuses other data. Checks lengths,
/// chunk order and the nesting of the JSON (limits.json_depth_max), so that it is safe to parse
/// recursively. Errors: kInvalidArgument, kTooLarge.
Result<GltfContainer> open_container(std::span<const std::byte> file, const GltfLimits& limits);

}  // namespace core
