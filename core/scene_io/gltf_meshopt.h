/// EXT_meshopt_compression: decodes the content of a view with libmeshoptimizer.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "core/base/result.h"
#include "core/scene_io/gltf_load.h"
#include "core/scene_io/gltf_tables.h"

namespace core {

/// Returns view_bytes bytes: the first count * stride are decoded and filtered, the rest are zero.
/// Pre: check_tables() accepted `meshopt`. Errors: kInvalidArgument at `where`.
Result<Bytes> decode_meshopt(const GltfMeshopt& meshopt, std::span<const std::byte> compressed,
                             std::uint64_t view_bytes, const std::string& where);

}  // namespace core
