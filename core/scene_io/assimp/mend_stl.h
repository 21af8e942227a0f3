/// Checks STL, and rewrites it so that libassimp reads it as other programs do.
#pragma once

#include <string>
#include <vector>

#include "core/scene_io/gltf_load.h"

namespace core {

/// Rewrites text: in UTF-8, keywords in small letters, no empty lines; and binary files: without
/// bytes after the last triangle, with the colours of Materialise as libassimp expects them. Adds
/// notes of damage. Returns an error text; empty: none.
std::string mend_stl(Bytes& file, std::vector<std::string>& notes);

}  // namespace core
