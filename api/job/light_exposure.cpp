#include "api/job/light_exposure.h"

#include <algorithm>
#include <cmath>

#include "api/json/limits.h"
#include "core/camera/orbit.h"
#include "core/color/rgb.h"
#include "core/lights/studio.h"

namespace api {
namespace {

/// Returns the direction from what the camera shows to the camera, world.
core::Vec3 to_camera(const JobSpec& spec) {
  if (spec.orbit) {
    core::CameraOrbit unit = *spec.orbit;
    unit.radius_m = 1;
    unit.target = core::Place{};
    return core::placed_on_orbit(spec.camera, unit, {}, 1, 1).position->rounded();
  }
  if (spec.camera.pose) {
    return normalize(-spec.camera.pose->forward());
  }
  if (spec.camera.position && spec.camera.target) {
    const core::Vec3 away = (*spec.camera.position - *spec.camera.target).rounded();
    if (dot(away, away) > 0) {
      return normalize(away);
    }
  }
  return {0, 0, 1};
}

}  // namespace

double auto_exposure_stops(const JobSpec& spec, const std::function<double()>& metered) {
  const core::EnvironmentSettings& light = spec.environment;
  const float strength = light.intensity * core::luminance(light.color);
  if (spec.environment_choice != EnvironmentChoice::kGiven || !light.preset || !(strength > 0)) {
    return metered();
  }
  constexpr auto kMost = static_cast<float>(limits::kExposureStops);
  const float stops =
      core::studio_exposure_stops(*light.preset, light.rotation_degrees, to_camera(spec)) -
      std::log2(strength);
  return static_cast<double>(std::clamp(stops, -kMost, kMost));
}

}  // namespace api
