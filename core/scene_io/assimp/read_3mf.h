/// Parts of a 3MF that libassimp does not read (the unit) or does not check (transforms).
#pragma once

#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/scene_io/gltf_load.h"

namespace core {

/// Returns the unit that the model names in its first element; libassimp leaves lengths as they
/// are. Adds notes of materials that are left out. Errors: an archive that read_zip_directory()
/// refuses, a damaged entry, no model, and one that is not in UTF-8, has its objects in other
/// files, or has a transform without the twelve numbers of the 3MF Core Specification, 3.3, beyond
/// which libassimp reads.
Result<std::string> check_3mf(const Bytes& file, std::vector<std::string>& notes);

}  // namespace core
