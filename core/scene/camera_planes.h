/// Near and far planes of the file's cameras that miss the whole model.
#pragma once

#include "core/description/scene_description.h"
#include "core/math/bounds.h"

namespace core {

/// Warns, in the description, of cameras that see nothing of the model because their far plane lies
/// before it, and of near planes behind it, which Camera leaves out. model: as Camera::create()
/// takes its bounds.
void check_planes(SceneDescription& scene, const Bounds& model);

}  // namespace core
