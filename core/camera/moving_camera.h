/// MovingCamera: the camera while the shutter is open.
#pragma once

#include <vector>

#include "core/base/result.h"
#include "core/camera/camera.h"

namespace core {

class MovingCamera {
 public:
  /// Arguments and errors: those of Camera::create().
  static Result<MovingCamera> create(const CameraSettings& settings,
                                     const std::vector<CameraDescription>& cameras,
                                     const Bounds& bounds, int width, int height);

  /// When the shutter opens.
  const Camera& first() const noexcept { return steps_.front(); }
  /// At `time`, the share of the interval, in [0, 1]: between two steps the lens and the directions
  /// go straight.
  Camera::CameraRay ray(Vec2 film_px, Vec2 lens, float time) const noexcept;

 private:
  std::vector<Camera> steps_;  ///< evenly spaced; one: it stays
};

}  // namespace core
