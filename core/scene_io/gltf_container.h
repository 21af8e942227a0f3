/// Splits a glTF file into its JSON text and binary chunk, without copying.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "core/base/result.h"
#include "core/scene_io/gltf_load.h"
#include "core/scene_io/gltf_repairs.h"

namespace core {

/// Up to this many bytes of padding may be missing: chunks of a GLB end at multiples of four.
inline constexpr std::size_t kPaddingMax = 3;

struct GltfContainer {
  std::string_view json;
  std::span<const std::byte> bin;  ///< of a GLB, if present
  bool has_bin = false;
};

/// Recognises GLB by its magic and JSON by its opening brace; refuses other data. Checks lengths,
/// chunk order and the nesting of the JSON (limits.json_depth_max), so that it is safe to parse
/// recursively. Mended: a wrong total length if all chunks are there, bytes after the last chunk,
/// missing padding of the last chunk, zeros after the JSON. Errors: kInvalidArgument, kTooLarge.
Result<GltfContainer> open_container(std::span<const std::byte> file, const GltfLimits& limits,
                                     GltfRepairs& repairs);

}  // namespace core
