/// View: everything a renderer needs to make one picture.
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
  /// The scene at the second time of the layer `motion`; null: nothing moves.
  std::shared_ptr<const MotionTarget> later;
  RenderSettings settings;
  /// Paths side by side, where waves serve: 8, or 1 for tests. 0: one path after the other, the
  /// same picture up to rounding.
  int wave_width = 8;
};

}  // namespace core
