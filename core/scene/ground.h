/// Ground for a model to stand on, as geometry that is added to its description.
#pragma once

#include "core/description/scene_description.h"
#include "core/math/bounds.h"
#include "core/settings/settings.h"

namespace core {

/// World, metres; of all instances that are no ground.
Bounds bounds_of(const SceneDescription& scene);

/// Adds the ground that the settings ask for; none: the scene stays. A catcher is a level square
/// about the model that is so large that what lies beyond does not matter. A sweep is a floor that
/// curves up into a wall on the far side. view_direction: of the camera; its level part says where
/// that is. A catcher is the same for all cameras, which share it.
void add_ground(SceneDescription& scene, const GroundSettings& settings,
                Vec3 view_direction = {0, 0, -1});

}  // namespace core
