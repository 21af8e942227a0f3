/// Which files of an archive make up a scene.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "server/scenes/zip.h"

namespace server {

/// `uri` seen from the folder of `document`, without `.` and `..`; empty when it leaves the
/// archive.
std::string path_in_archive(std::string_view document, std::string_view uri);

/// The one .glb or .gltf of an archive; of several the one in the topmost folder. Errors:
/// kInvalidArgument for none, and for several side by side.
core::Result<const ZipEntry*> main_document(const std::vector<ZipEntry>& entries);

}  // namespace server
