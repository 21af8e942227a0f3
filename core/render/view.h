/// View: everything that a renderer needs to render one image.
#pragma once

#include <memory>

#include "core/base/result.h"
#include "core/labels/motion.h"
#include "core/lights/environment.h"
#include "core/scene/scene.h"
#include "core/settings/settings.h"

namespace core {

struct View {
  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const Environment> environment;  ///< null: black
  CameraSettings camera;
  /// The scene at the second time of the layer `motion`; null if nothing moves.
  std::shared_ptr<const MotionTarget> later;
  RenderSettings settings;
  /// Paths per wave, if the integrator supports waves: 8, or 1 for tests. 0 traces one path at a
  /// time; the image is the same up to rounding.
  int wave_width = 8;
};

}  // namespace core
