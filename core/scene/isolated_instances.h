/// Instances with nothing near them: what depends only on a body's shape is the same for all of
/// them.
#pragma once

#include <vector>

#include "core/scene/scene_data.h"

namespace core {

/// Returns for each instance whether no other one and no top-level mesh is within `edges` times its
/// longest edge, judged by boxes.
std::vector<bool> find_isolated_instances(const SceneData& scene, float edges);

}  // namespace core
