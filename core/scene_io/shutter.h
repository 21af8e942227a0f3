/// What moves while the shutter is open.
#pragma once

#include <cstddef>
#include <span>

#include "core/base/result.h"
#include "core/description/scene_description.h"

namespace core {

/// Moments at which a file is read for an open shutter, its opening and closing among them.
inline constexpr int kShutterSteps = 9;

/// Puts into `scene` where its meshes and cameras are `later`: descriptions of the same file at
/// kShutterSteps - 1 further, evenly spaced times, which load_gltf() may read with geometry_only.
/// A mesh keeps the fewest of 2, 3, 5 or 9 moments between which its vertices go straight enough.
/// Errors: kInvalidArgument at "/shutter_seconds" for what a shutter cannot show; kTooLarge when
/// what moves takes more than bytes_max.
Status open_shutter(SceneDescription& scene, std::span<const SceneDescription> later,
                    std::size_t bytes_max);

}  // namespace core
