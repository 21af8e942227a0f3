#include "core/camera/moving_camera.h"

#include <algorithm>
#include <cstddef>

namespace core {

Result<MovingCamera> MovingCamera::create(const CameraSettings& settings,
                                          const std::vector<CameraDescription>& cameras,
                                          const Bounds& bounds, int width, int height) {
  std::size_t later = 0;
  for (const CameraDescription& camera : cameras) {
    later = std::max(later, camera.later.size());
  }
  MovingCamera out;
  std::vector<CameraDescription> then = cameras;
  for (std::size_t step = 0; step <= later; ++step) {
    for (CameraDescription& camera : then) {
      if (step > 0 && !camera.later.empty()) {
        camera.to_world = camera.later[step - 1];
      }
    }
    const auto camera = Camera::create(settings, then, bounds, width, height);
    if (!camera) {
      return camera.error();
    }
    out.steps_.push_back(*camera);
  }
  return out;
}

Camera::CameraRay MovingCamera::ray(Vec2 film_px, Vec2 lens, float time) const noexcept {
  const std::size_t segments = steps_.size() - 1;
  const float at = time * static_cast<float>(segments);
  const std::size_t step = std::min(static_cast<std::size_t>(at), segments);
  Camera::CameraRay out = steps_[step].ray(film_px, lens);
  if (step < segments) {
    const float part = at - static_cast<float>(step);
    const Ray next = steps_[step + 1].ray(film_px, lens).ray;
    out.ray.origin = out.ray.origin * (1 - part) + next.origin * part;
    out.ray.direction = normalize(out.ray.direction * (1 - part) + next.direction * part);
  }
  out.ray.time = time;
  return out;
}

}  // namespace core
