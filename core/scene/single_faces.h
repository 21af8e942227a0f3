/// Finds where no other surface coincides with those of solids.
#pragma once

#include <stop_token>

#include "core/base/parallel_for.h"
#include "core/scene/scene_data.h"

namespace core {

/// Fills scene.near_planes and scene.edge_margin_m; leaves them empty in scenes with motion and if
/// stop is requested. After find_solids(), the acceleration structure and
/// the scene's radius.
void find_single_faces(SceneData& scene, const ParallelFor& parallel, const std::stop_token& stop);

}  // namespace core
