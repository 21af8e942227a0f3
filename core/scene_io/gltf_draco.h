/// KHR_draco_mesh_compression: decodes a primitive with libdraco.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/scene_io/gltf_source.h"

namespace core {

struct DracoAttribute {
  int unique_id = -1;  ///< as in the extension's "attributes"
  int accessor = -1;   ///< gives the number of values and whether they are normalised
};

struct DracoPrimitive {
  std::map<std::string, std::vector<float>> attributes;  ///< by glTF name, normalised
  std::vector<std::uint32_t> triangles;                  ///< three indices per triangle
};

/// Errors: kInvalidArgument at `where`; kTooLarge.
Result<DracoPrimitive> decode_draco(GltfSource& source, int view,
                                    const std::map<std::string, DracoAttribute>& attributes,
                                    const std::string& where);

}  // namespace core
