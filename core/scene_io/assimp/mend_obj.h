/// Rewrites OBJ and text STL so that libassimp reads them as other programs do.
#pragma once

#include <string>
#include <vector>

#include "core/scene_io/assimp/read_model.h"

namespace core {

/// Rewrites the OBJ, which is the first file: without indents, continued lines, comments after
/// values and faces of fewer than three corners (a note), with one file for each mtllib and digits
/// before points. Returns an error text; empty: none.
std::string mend_obj(std::vector<ModelFile>& files, std::vector<std::string>& notes);

/// Rewrites text: keywords in small letters, no empty lines. Returns an error text for this and
/// binary STL; empty: none.
std::string mend_stl(Bytes& file);

}  // namespace core
