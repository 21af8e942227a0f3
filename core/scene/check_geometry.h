/// Meshes and instances of a description: do their parts fit together?
#pragma once

#include "core/base/result.h"
#include "core/description/scene_description.h"

namespace core {

/// Errors: kInvalidArgument, with the place.
Status check_geometry(const SceneDescription& scene);

}  // namespace core
