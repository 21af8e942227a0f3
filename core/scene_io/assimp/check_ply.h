/// Checks that a PLY has the elements of its header.
#pragma once

#include <string>
#include <vector>

#include "core/scene_io/gltf_load.h"

namespace core {

/// Returns an error text for files that end before their elements do, for vertices without
/// coordinates, and for coordinates that are not finite; empty: none. Adds notes of properties that
/// are left out. What else is wrong is left to libassimp.
std::string check_ply(const Bytes& file, std::vector<std::string>& notes);

}  // namespace core
