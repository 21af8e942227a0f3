/// Adds a ground below the model to its description, as geometry.
#pragma once

#include "core/description/scene_description.h"
#include "core/settings/settings.h"

namespace core {

/// Adds the ground that the settings ask for, if any. A catcher is a horizontal square around the
/// model, so large that its edges do not matter; all cameras share the same one. A sweep is a floor
/// that curves up into a wall on the far side, as given by the horizontal part of the camera's
/// view_direction.
void add_ground(SceneDescription& scene, const GroundSettings& settings,
                Vec3 view_direction = {0, 0, -1});

}  // namespace core
