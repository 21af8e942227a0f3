/// Splits a glTF file into its JSON text and its binary chunk; nothing is copied.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "core/base/result.h"
#include "core/scene_io/gltf_load.h"

namespace core {

struct GltfContainer {
  std::string_view json;
  std::span<const std::byte> bin;  ///< of a GLB that has one
  bool has_bin = false;
};

/// GLB by its magic, JSON text by its brace; anything else is neither. Checks lengths, chunk order
/// and the nesting of the JSON (limits.json_depth_max), so that a recursive parser may follow.
/// Errors: kInvalidArgument, kTooLarge.
Result<GltfContainer> open_container(std::span<const std::byte> file, const GltfLimits& limits);

}  // namespace core
