/// Solids whose surface is in several nodes of the file.
#pragma once

#include <cstdint>
#include <vector>

#include "core/scene/solids.h"

namespace core {

/// Turns meshes that close a surface with those of other instances and are wound the other way than
/// these: the smaller side, as align_windings() does with the primitives of one mesh. Warns of each
/// in the description. Only meshes that rest in world space are taken. Returns the placed meshes of
/// each such surface, whether some were turned or not.
std::vector<std::vector<std::uint32_t>> turn_pieces(SceneData& scene, const PlacedFrom& from);

}  // namespace core
