/// intersect: finds the next surface along a path.
#pragma once

#include "core/scene/scene_data.h"
#include "core/transport/path_state.h"
#include "core/transport/vertex.h"

namespace core {

/// Traces path.ray to the nearest surface and fills point, wo_world and distance_m of `vertex`.
/// Skips holes: a surface with coverage a (MASK: 0 or 1; BLEND: alpha) is hit with probability a.
/// Returns false if the ray left the scene.
bool intersect(const SceneData& scene, PathState& path, PathVertex& vertex) noexcept;

}  // namespace core
