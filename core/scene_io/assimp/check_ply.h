/// Checks that a PLY has the elements of its header.
#pragma once

#include <string>

#include "core/scene_io/gltf_load.h"

namespace core {

/// Returns an error text for files that end before their elements do, and for coordinates that are
/// not finite; empty: none. What else is wrong is left to libassimp.
std::string check_ply(const Bytes& file);

}  // namespace core
