/// intersect: the next surface along a path.
#pragma once

#include "core/scene/scene_data.h"
#include "core/transport/path_state.h"
#include "core/transport/vertex.h"

namespace core {

/// Traces path.ray to the nearest surface that is there and fills point, wo_world and distance_m of
/// `vertex`. Holes are skipped: at coverage a (MASK: 0 or 1; BLEND: alpha) a surface is there with
/// probability a. False: the ray left the scene.
bool intersect(const SceneData& scene, PathState& path, PathVertex& vertex) noexcept;

}  // namespace core
