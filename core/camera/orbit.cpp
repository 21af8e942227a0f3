#include "core/camera/orbit.h"

#include <algorithm>
#include <cmath>

#include "core/math/numbers.h"

namespace core {

namespace {
constexpr float kDegree = kPi / 180;
constexpr float kUsualFovDegrees = 45;
}  // namespace

float fitting_distance_m(float radius_m, float vertical_fov_rad, float aspect) {
  const float horizontal = 2 * std::atan(std::tan(vertical_fov_rad * 0.5F) * aspect);
  return radius_m / std::sin(std::min(vertical_fov_rad, horizontal) * 0.5F);
}

CameraSettings placed_on_orbit(CameraSettings camera, const CameraOrbit& orbit,
                               const Bounds& bounds, int width, int height) {
  const Vec3 center = bounds.empty() ? Vec3{} : bounds.center();
  const float size = bounds.radius_or(1);
  const float fov = camera.vertical_fov_degrees.value_or(kUsualFovDegrees) * kDegree;
  const float aspect = static_cast<float>(width) / static_cast<float>(height);
  const float radius = orbit.radius_m.value_or(fitting_distance_m(size, fov, aspect));
  const float theta = orbit.theta_degrees * kDegree;
  const float phi = orbit.phi_degrees * kDegree;
  const Vec3 outward{std::sin(phi) * std::sin(theta), std::cos(phi),
                     std::sin(phi) * std::cos(theta)};
  // The meridian's direction is the up direction of a level camera, and also valid at the poles.
  const Vec3 north{-std::cos(phi) * std::sin(theta), std::sin(phi),
                   -std::cos(phi) * std::cos(theta)};
  camera.target = orbit.target.value_or(center);
  camera.position = *camera.target + Place(outward * radius);
  if (!camera.up) {
    camera.up = north;
  }
  return camera;
}

}  // namespace core
