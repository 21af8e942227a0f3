/// A scene with rare, bright noise.
#pragma once

#include "tests/support/scenes.h"

namespace test_support {

/// A square emitter behind clear glass: paths find the caustics on the floor only by chance.
inline core::View caustic(float side_m = 1, float radiance = 12) {
  core::View view =
      view_of(scene_of({lambert(core::Rgb(0.6F)), glass(), emitter(core::Rgb(radiance))},
                       {quad({-4, 0, 4}, {8, 0, 0}, {0, 0, -8}, 0),
                        sphere({0, 0.7F, 0}, 0.5F, 16, false, 1),
                        quad({-side_m / 2, 2, -side_m / 2}, {side_m, 0, 0}, {0, 0, side_m}, 2)}),
              48, 48);
  look_at(view, {0, 1.2F, 3}, {0, 0.4F, 0}, 40);
  view.settings.max_depth = 6;
  return view;
}

}  // namespace test_support
