/// Finds the files of a scene in an archive.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "server/scenes/zip.h"

namespace server {

/// Resolves `uri` against the folder of `document`, removing `.` and `..`; empty when it leaves the
/// archive.
std::string path_in_archive(std::string_view document, std::string_view uri);

/// Returns the only .glb or .gltf of an archive; of several, the one in the topmost folder. Errors:
/// kInvalidArgument for none, and for several in the same folder.
core::Result<const ZipEntry*> main_document(const std::vector<ZipEntry>& entries);

}  // namespace server
