/// A view of a built-in scene, or of files.
#pragma once

#include <string>

#include "core/render/view.h"

namespace bench {

/// name: a built-in scene, or GLTF,HDR: the file from where all of it is seen, under the map. Stops
/// the program where there is no such scene or file.
core::View named_view(const std::string& name, int width, int height);

}  // namespace bench
