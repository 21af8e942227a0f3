/// Rewrites OBJ so that libassimp reads it as other programs do.
#pragma once

#include <string>
#include <vector>

#include "core/scene_io/assimp/read_model.h"

namespace core {

/// Rewrites the OBJ, which is the first file: in UTF-8, without indents, continued lines, comments
/// and statements other than vertices, faces, names and materials; with one file for each mtllib,
/// digits before points, and corners that all have the same indices, which count from 1. Adds notes
/// of parts that are left out. Returns an error text; empty: none.
std::string mend_obj(std::vector<ModelFile>& files, std::vector<std::string>& notes);

}  // namespace core
