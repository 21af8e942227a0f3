/// Splits a glTF document whose buffers and images are data URIs into a short document and files.
///
/// Programs that render many views of one world, such as Drake, send all of its meshes with each.
/// Files are named by their content, so a mesh that was sent before is known, wherever its node is
/// now.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "core/base/result.h"
#include "core/scene_io/gltf_load.h"

namespace core {

struct SplitGltf {
  Bytes document;
  std::map<std::string, SharedBytes> files;  ///< by the uri in the document
};

/// turns_z_up: the document's z axis is up, against glTF 2.0, 3.4; its scenes are turned so that y
/// is. Errors: kInvalidArgument, kTooLarge; content that does not concern this is not checked.
Result<SplitGltf> split_gltf(std::string_view json, bool turns_z_up, const GltfLimits& limits = {});

/// Returns the same with one buffer, so that storing it takes few files. Documents that do not fit
/// the schema stay as they are.
SplitGltf join_buffers(SplitGltf split);

}  // namespace core
