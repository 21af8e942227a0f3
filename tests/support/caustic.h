/// A scene with rare, bright noise.
#pragma once

#include "tests/support/scenes.h"

namespace test_support {

/// An emitter behind clear glass: paths find the caustics on the floor only by chance.
inline core::View caustic() {
  core::MaterialDescription glass;
  glass.metallic = 0;
  glass.roughness = 0;
  glass.transmission = 1;
  glass.thickness = 1;
  core::View view =
      view_of(build(scene_of({lambert(core::Rgb(0.6F)), glass, emitter(core::Rgb(12))},
                             {quad({-4, 0, 4}, {8, 0, 0}, {0, 0, -8}, 0),
                              sphere({0, 0.7F, 0}, 0.5F, 16, false, 1),
                              quad({-0.5F, 2, -0.5F}, {1, 0, 0}, {0, 0, 1}, 2)})),
              48, 48);
  look_at(view, {0, 1.2F, 3}, {0, 0.4F, 0}, 40);
  view.settings.max_depth = 6;
  return view;
}

}  // namespace test_support
