/// Sets surfaces apart that lie on others. Which of two coincident surfaces a ray meets first is
/// left to rounding, and a ray that goes on behind one has passed both: a wall behind a decal or
/// clear pane would not exist, and each of two emitters in one place would light the scene.
#pragma once

#include "core/scene/scene_data.h"

namespace core {

/// Moves meshes that let rays pass (MASK, BLEND, thin walls) to the front of what they lie on, and
/// those that emit to the front of opaque ones: by twice the distance up to which rounding may
/// confuse the two. Of meshes of one kind, later ones are in front. radius_m: of the scene. Returns
/// whether a mesh was moved, so that the acceleration structure must be built again. Pre:
/// scene.placed, instances and accel are complete.
bool set_apart(SceneData& scene, float radius_m);

}  // namespace core
