#include "core/scene/camera_planes.h"

#include <cstddef>
#include <string>
#include <vector>

#include "core/base/text.h"

namespace core {
namespace {

std::string metres(float value) { return shortest_text(value) + " m"; }

/// One warning for all cameras, of which the first is named. what: its plane.
void warn(SceneDescription& scene, const std::vector<const CameraDescription*>& cameras,
          const std::string& what) {
  const std::size_t others = cameras.size() - 1;
  const std::string& name = cameras.front()->name;
  scene.warnings.emplace_back(
      "camera", "",
      (name.empty() ? "a camera without a name" : "camera '" + name + "'") + ": " + what +
          (others == 0 ? "" : " (and " + std::to_string(others) + " more cameras alike)"));
}

}  // namespace

void check_planes(SceneDescription& scene, const Bounds& model) {
  std::vector<const CameraDescription*> before;
  std::vector<const CameraDescription*> beyond;
  for (const CameraDescription& camera : scene.cameras) {
    const Vec3 forward = normalize_or(-camera.to_world.z, {0, 0, 0});
    const Extent depth = extent_along(model, camera.to_world.t, forward);
    if (model.empty() || !(length_squared(forward) > 0) || !(depth.most > 0)) {
      continue;
    }
    if (camera.far_m < depth.least) {
      before.push_back(&camera);
    } else if (camera.near_m >= depth.most) {
      beyond.push_back(&camera);
    }
  }
  if (!before.empty()) {
    warn(scene, before,
         "its zfar of " + metres(before.front()->far_m) +
             " lies before the whole model, of which nothing is visible");
  }
  if (!beyond.empty()) {
    warn(scene, beyond,
         "its znear of " + metres(beyond.front()->near_m) +
             " lies behind the whole model; it is left out");
  }
}

}  // namespace core
