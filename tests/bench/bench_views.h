/// Views that benchmarks share.
#pragma once

#include <string_view>

#include "core/render/view.h"

namespace bench {

/// A built-in scene by its first camera, under a white sky where it has no light; no layers beside
/// the picture. Stops the program where there is no such scene.
core::View builtin_view(std::string_view name, int width, int height);
inline core::View builtin_view(std::string_view name, int width) {
  return builtin_view(name, width, width * 9 / 16);
}

}  // namespace bench
