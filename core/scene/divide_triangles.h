/// Divides triangles that are too large for what stands on them. Rays leave a triangle by a step in
/// proportion to its edges (core/math/offset_ray.h), so that what is not much larger than that step
/// would lose its contact and its shadow: a cup on a ground of kilometres.
#pragma once

#include <cstddef>

#include "core/scene/scene_data.h"

namespace core {

/// Bisects triangles of the first `count` placed meshes near smaller meshes, until their step is
/// small for these. Neighbours in a mesh stay neighbours; moving meshes stay as they are. Returns
/// the number of triangles added. Pre: these meshes are in world space and placed once;
/// scene.placed and instances are complete.
std::size_t divide_triangles(SceneData& scene, std::size_t count);

}  // namespace core
