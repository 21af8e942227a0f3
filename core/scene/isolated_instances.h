/// Instances with nothing near them: what depends only on a body's shape is the same for all of
/// them.
#pragma once

#include <cstddef>
#include <span>
#include <stop_token>
#include <vector>

#include "core/scene/scene_data.h"

namespace core {

/// Returns the meshes of an instance.
std::span<const PlacedMesh> placed_of(const SceneData& scene, std::size_t instance) noexcept;

/// Returns for each instance whether no other one and no top-level mesh is within `edges` times its
/// longest edge, judged by boxes that are larger than both. Stops early, with any result, if asked.
std::vector<bool> find_isolated_instances(const SceneData& scene, float edges,
                                          const std::stop_token& stop);

}  // namespace core
