/// Checks that a PLY has the elements of its header.
#pragma once

#include <string>
#include <vector>

#include "core/scene_io/gltf_load.h"

namespace core {

/// Returns an error text for headers that are not understood, for files that end before their
/// elements do, for coordinates that are missing or not finite, and for faces without corners or
/// with others than the file's vertices, and for strips; empty: none. Adds notes of parts that are
/// left out.
std::string check_ply(const Bytes& file, std::vector<std::string>& notes);

}  // namespace core
