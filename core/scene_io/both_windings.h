/// Triangles that a primitive has twice, in both windings: a way to write two-sided faces.
#pragma once

#include <vector>

#include "core/description/scene_description.h"

namespace core {

/// Returns for each triangle whether an earlier one has the same corners in the opposite order.
std::vector<bool> find_backs(const PrimitiveDescription& primitive);

/// Removes these triangles from a primitive and returns them; its vertices remain.
std::vector<std::uint32_t> take_triangles(PrimitiveDescription& primitive,
                                          const std::vector<bool>& which);

}  // namespace core
