/// Checks that the meshes and instances of a description are consistent.
#pragma once

#include "core/base/result.h"
#include "core/description/scene_description.h"

namespace core {

/// Errors: kInvalidArgument, with the location.
Status check_geometry(const SceneDescription& scene);

}  // namespace core
