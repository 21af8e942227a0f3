#include "core/camera/orbit.h"

#include <algorithm>
#include <cmath>

#include "core/camera/camera_choice.h"
#include "core/camera/framing.h"
#include "core/math/numbers.h"

namespace core {

namespace {
constexpr float kDegree = kPi / 180;

/// Tangents of half the view's width and height, without the margins.
Vec2 inside_of(const CameraSettings& camera, int width, int height, float margin) {
  const Vec2 half = half_view(camera, width, height);
  return {half.x * (1 - 2 * margin), half.y * (1 - 2 * margin)};
}
}  // namespace

float fitting_distance_m(float radius_m, Vec2 half_view) {
  return radius_m / std::sin(std::atan(std::min(half_view.x, half_view.y)));
}

CameraSettings placed_on_orbit(CameraSettings camera, const CameraOrbit& orbit,
                               const Bounds& bounds, int width, int height) {
  const Vec3 center = bounds.empty() ? Vec3{} : bounds.center();
  const float size = bounds.radius_or(1);
  const float radius =
      orbit.radius_m.value_or(fitting_distance_m(size, half_view(camera, width, height)));
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

float framing_distance_m(const CameraSettings& camera, const CameraOrbit& orbit,
                         const Bounds& bounds, int width, int height, float margin) {
  CameraOrbit unit = orbit;
  unit.radius_m = 1;
  unit.target = Place{};
  const CameraSettings placed = placed_on_orbit(camera, unit, bounds, width, height);
  const Vec3 outward = placed.position->rounded();
  const Vec3 right = normalize(cross(*placed.up, outward));
  const Vec3 up = cross(outward, right);
  const auto [tan_x, tan_y] = inside_of(camera, width, height, margin);
  float distance = 0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    const Vec3 at = Vec3{(corner & 1U) != 0 ? bounds.max.x : bounds.min.x,
                         (corner & 2U) != 0 ? bounds.max.y : bounds.min.y,
                         (corner & 4U) != 0 ? bounds.max.z : bounds.min.z} -
                    bounds.center();
    // |dot(at, right)| <= (distance - dot(at, outward)) tan_x, and so for y.
    distance = std::max({distance, dot(at, outward) + std::fabs(dot(at, right)) / tan_x,
                         dot(at, outward) + std::fabs(dot(at, up)) / tan_y});
  }
  return distance;
}

float turning_distance_m(const CameraSettings& camera, const CameraOrbit& orbit,
                         const Bounds& bounds, int width, int height, float margin) {
  const auto [tan_x, tan_y] = inside_of(camera, width, height, margin);
  const Vec3 half = bounds.diagonal() * 0.5F;
  const float radius = std::hypot(half.x, half.z);
  const float sin = std::sin(orbit.phi_degrees * kDegree);
  const float cos = std::cos(orbit.phi_degrees * kDegree);
  float distance = 0;
  for (const float y : {-half.y, half.y}) {
    // A corner, turned by a from the camera's meridian, is at radius sin(a) to the right,
    // y sin - radius cos cos(a) up and y cos + radius sin cos(a) outward. Sideways, the greatest
    // of p cos(a) + q |sin(a)| is hypot(p, q); upward, a convex function of cos(a) is greatest at
    // an end.
    distance = std::max(distance, y * cos + radius * std::hypot(sin, 1 / tan_x));
    for (const float out : {-radius, radius}) {
      distance = std::max(distance, y * cos + out * sin + std::fabs(y * sin - out * cos) / tan_y);
    }
  }
  return distance;
}

}  // namespace core
