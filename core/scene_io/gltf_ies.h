/// EXT_lights_ies: the light profiles of a file.
#pragma once

#include "core/base/result.h"
#include "core/description/scene_description.h"
#include "core/scene_io/gltf_source.h"

namespace core {

/// Fills scene.profiles. Errors: those of read_ies() at "/extensions/EXT_lights_ies/lights/N";
/// kTooLarge.
Status read_profiles(GltfSource& source, SceneDescription& scene);

}  // namespace core
