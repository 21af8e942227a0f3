/// A scattering solid.
#pragma once

#include <cmath>

#include "core/media/medium.h"
#include "tests/support/scenes.h"

namespace test_support {

/// Returns the colour of KHR_materials_volume_scatter that results in this single-scattering
/// albedo.
inline float color_for(float albedo, float g) {
  float low = 0;
  float high = 1;
  for (int i = 0; i < 40; ++i) {
    const float middle = 0.5F * (low + high);
    (core::single_scattering_albedo(middle, g) < albedo ? low : high) = middle;
  }
  return high;
}

/// A solid with a mean free path of `mean_free_path_m`; with ior 1 its boundary is invisible.
inline core::MaterialDescription milk(float albedo, float mean_free_path_m, float g = 0,
                                      float ior = 1) {
  core::MaterialDescription m = glass(ior);
  m.attenuation_distance = mean_free_path_m;
  m.attenuation_color = core::Rgb(std::exp(-1.0F));
  m.multiscatter_color = core::Rgb(color_for(albedo, g));
  m.scatter_anisotropy = g;
  return m;
}

}  // namespace test_support
