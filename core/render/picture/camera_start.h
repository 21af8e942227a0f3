/// place_in_solids: the solids that camera rays start in.
#pragma once

#include "core/camera/moving_camera.h"
#include "core/scene/scene_data.h"

namespace core {

/// Finds the solids around the origins of all rays of a film of this size, and tells the camera.
/// They are found once if they are the same for the whole lens; else each ray finds its own: on a
/// lens or a moving camera that crosses the surface of a solid, and on an orthographic film that
/// may cross one. is_moving: the shutter is open, so that solids may move too.
void place_in_solids(MovingCamera& camera, const SceneData& scene, Vec2 film_px, bool is_moving);

}  // namespace core
