/// Divides triangles that are too large for what stands on them. Rays leave a triangle by a step in
/// proportion to its edges (core/math/offset_ray.h), so that what is not much larger than that step
/// would lose its contact and its shadow: a cup on a ground of kilometres.
#pragma once

#include <cstddef>

#include "core/scene/scene_data.h"

namespace core {

/// Bisects triangles near smaller meshes, until their step is small for these. Neighbours in a mesh
/// stay neighbours. Returns the number of triangles added, in all instances. Pre: scene.placed and
/// instances are complete.
std::size_t divide_triangles(SceneData& scene);

}  // namespace core
