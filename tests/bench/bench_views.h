/// Views shared by benchmarks.
#pragma once

#include <string_view>

#include "core/render/picture/view.h"

namespace bench {

/// A built-in scene seen by its first camera, under a white sky if it has no light; no layers
/// except the image. Stops the program if the scene does not exist.
core::View builtin_view(std::string_view name, int width, int height);
inline core::View builtin_view(std::string_view name, int width) {
  return builtin_view(name, width, width * 9 / 16);
}

}  // namespace bench
