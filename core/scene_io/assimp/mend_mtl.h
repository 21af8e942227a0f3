/// Rewrites MTL files so that libassimp reads them as other programs do.
#pragma once

#include <string>
#include <vector>

#include "core/scene_io/assimp/read_model.h"

namespace core {

/// Rewrites the files whose names end in .mtl: without indents, options of textures and statements
/// that are not read, and with three components for each colour. Returns a note of the statements
/// that are left out, and of the options of textures; empty: none.
std::string mend_materials(std::vector<ModelFile>& files);

}  // namespace core
