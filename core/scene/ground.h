/// Adds a ground below the model to its description, as geometry.
#pragma once

#include "core/description/scene_description.h"
#include "core/math/bounds.h"
#include "core/settings/settings.h"

namespace core {

/// Returns whether rays can hit a surface of the material: its alpha factor, which textures and
/// vertex colours only reduce, does not remove it.
bool is_drawn(const MaterialDescription& material) noexcept;

/// Returns the world bounds [m] of what is drawn of the instances that are not ground: vertices of
/// triangles whose material is_drawn(). Automatic cameras frame them.
Bounds bounds_of(const SceneDescription& scene);

/// Adds the ground that the settings ask for, if any. A catcher is a horizontal square around the
/// model, so large that its edges do not matter; all cameras share the same one. A sweep is a floor
/// that curves up into a wall on the far side, as given by the horizontal part of the camera's
/// view_direction.
void add_ground(SceneDescription& scene, const GroundSettings& settings,
                Vec3 view_direction = {0, 0, -1});

}  // namespace core
