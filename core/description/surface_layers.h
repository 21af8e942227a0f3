/// SurfaceLayers: the less common lobes of a surface, which most materials lack.
#pragma once

#include "core/color/rgb.h"

namespace core {

/// Factors of a material, and, after texturing, values of a point.
struct SurfaceLayers {
  float clearcoat = 0;
  float clearcoat_roughness = 0;
  Rgb sheen_color = {0, 0, 0};
  float sheen_roughness = 0;
  float iridescence = 0;
  float iridescence_ior = 1.3F;
  float diffuse_transmission = 0;
  Rgb diffuse_transmission_color = {1, 1, 1};

  /// Returns whether there is any of them.
  bool has_layers() const noexcept {
    return clearcoat > 0 || !is_black(sheen_color) || iridescence > 0 || diffuse_transmission > 0;
  }
  /// Calls f for each colour, which becomes values of wavelengths for spectral paths.
  template <typename F>
  void for_each_color(F&& f) {
    f(sheen_color);
    f(diffuse_transmission_color);
  }
};

}  // namespace core
