/// A view of a built-in scene, or of files.
#pragma once

#include <string>

#include "core/render/picture/view.h"

namespace bench {

/// name: a built-in scene, one of caustic_view(), or a file: GLTF, GLTF,HDR under a map, GLTF,white
/// under a white sky. Stops the program if the scene or file does not exist.
core::View named_view(const std::string& name, int width, int height);

}  // namespace bench
