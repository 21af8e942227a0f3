/// Motion while the shutter is open.
#pragma once

#include <cstddef>
#include <span>

#include "core/base/result.h"
#include "core/description/scene_description.h"

namespace core {

/// Number of times at which a file is read for an open shutter, including opening and closing.
inline constexpr int kShutterSteps = 9;

/// Adds the motion of meshes and cameras to `scene`. later: descriptions of the same file at
/// kShutterSteps - 1 further, evenly spaced times, which load_gltf() may read with geometry_only. A
/// mesh keeps the fewest of 2, 3, 5 or 9 times between which its vertices move linearly to
/// sufficient accuracy. Keys with STEP are read at the opening, as GltfOptions::opening_seconds
/// says: nothing moves over their jumps. Errors: kInvalidArgument at "/shutter_seconds" for motion
/// that is not supported; kTooLarge if moving vertices need more than bytes_max.
Status open_shutter(SceneDescription& scene, std::span<const SceneDescription> later,
                    std::size_t bytes_max);

}  // namespace core
