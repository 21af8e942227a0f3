/// MovingCamera: the camera while the shutter is open.
#pragma once

#include <memory>
#include <vector>

#include "core/base/result.h"
#include "core/camera/camera.h"

namespace core {

class MovingCamera {
 public:
  /// Arguments and errors: as Camera::create().
  static Result<MovingCamera> create(const CameraSettings& settings,
                                     const std::vector<CameraDescription>& cameras,
                                     const Bounds& bounds, int width, int height);

  /// As Camera::start_in().
  void start_in(const std::shared_ptr<const StartMedia>& start) noexcept {
    for (Camera& step : steps_) {
      step.start_in(start);
    }
  }
  /// Returns the camera when the shutter opens.
  const Camera& first() const noexcept { return steps_.front(); }
  bool is_at_rest() const noexcept { return steps_.size() == 1; }
  /// Returns the ray at `time`, the fraction of the interval in [0, 1]. Interpolates lens and
  /// directions linearly between steps.
  Camera::CameraRay ray(Vec2 film_px, Vec2 lens, float time) const noexcept;

 private:
  std::vector<Camera> steps_;  ///< evenly spaced; one step: no motion
};

}  // namespace core
