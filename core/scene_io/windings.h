/// Windings of triangles: those that a primitive has twice, in both windings, which is a way to
/// write two-sided faces, and those that face the other way than their neighbours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/description/scene_description.h"

namespace core {

/// Returns for each triangle whether an earlier one has the same corners in the opposite order.
std::vector<bool> find_backs(const PrimitiveDescription& primitive);

/// Removes these triangles from a primitive and returns them; its vertices remain.
std::vector<std::uint32_t> take_triangles(PrimitiveDescription& primitive,
                                          const std::vector<bool>& which);

/// Turns triangles so that neighbours pass their common edge in opposite directions: of each
/// connected surface the smaller side. Surfaces with one side only stay. Then turns closed surfaces
/// that face inwards, if another one faces outwards and none surrounds them. Where a primitive
/// ends, another one continues it if it has the same edge. Returns the number of triangles turned
/// in each primitive.
std::vector<std::size_t> align_windings(std::span<PrimitiveDescription* const> primitives);

}  // namespace core
