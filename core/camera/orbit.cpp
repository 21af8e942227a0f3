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

/// How near the camera may stand for one side of the image, and how far from the centre of the
/// model's box its target then is on that side.
struct Fitted {
  float distance_m = 0;
  float shift_m = 0;
};

/// Below it, as a fraction of the view, tangents are alike: a hundredth of a pixel of a wide image.
constexpr float kLeastTangent = 1e-6F;

/// Returns the centre of the points' bounding box.
Vec3 center_of(const std::vector<Vec3>& points) {
  Bounds box;
  for (const Vec3& point : points) {
    box.add(point);
  }
  return box.center();
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

Framing nearest_framing(const CameraSettings& camera, const CameraOrbit& orbit,
                        const std::vector<Vec3>& points, int width, int height, float margin) {
  CameraOrbit unit = orbit;
  unit.radius_m = 1;
  unit.target = Place{};
  const CameraSettings placed = placed_on_orbit(camera, unit, {}, width, height);
  const Vec3 outward = placed.position->rounded();
  const Vec3 right = normalize(cross(*placed.up, outward));
  const Vec3 up = cross(outward, right);
  const Vec3 center = center_of(points);
  const auto extent = [&](Vec3 direction) {
    float most = -Bounds::kInf;
    for (const Vec3& point : points) {
      most = std::max(most, dot(point - center, direction));
    }
    return most;
  };
  // From a target at a to the right, |dot(p, right) - a| <= (distance - dot(p, outward)) tan_x for
  // each point p, which is two bounds on the distance. Their greater is least where they are equal.
  const auto fitted = [&](Vec3 side, float tangent) {
    const float after = extent(side + outward * tangent);
    const float before = extent(outward * tangent - side);
    return Fitted{(after + before) / (2 * tangent), (after - before) / 2};
  };
  const auto [tan_x, tan_y] = inside_of(camera, width, height, margin);
  const float distance = std::max(fitted(right, tan_x).distance_m, fitted(up, tan_y).distance_m);
  // Seen from there, the shorter side of the model ends at some smaller tangent.
  const auto middle = [&](Vec3 side, float tangent) {
    float low = tangent * kLeastTangent;  // where the distance is still too great
    for (float step = tangent / 2; step > tangent * kLeastTangent; step /= 2) {
      low += fitted(side, low + step).distance_m > distance ? step : 0;
    }
    return side * fitted(side, low).shift_m;
  };
  return {distance, center + middle(right, tan_x) + middle(up, tan_y)};
}

Framing turning_framing(const CameraSettings& camera, const CameraOrbit& orbit,
                        const std::vector<Vec3>& points, int width, int height, float margin) {
  const auto [tan_x, tan_y] = inside_of(camera, width, height, margin);
  const float sin = std::sin(orbit.phi_degrees * kDegree);
  const float cos = std::cos(orbit.phi_degrees * kDegree);
  const Vec3 center = center_of(points);
  float distance = 0;
  for (const Vec3& point : points) {
    const Vec3 at = point - center;
    const float radius = std::hypot(at.x, at.z);
    // Turned by a from the camera's meridian, the point is at radius sin(a) to the right,
    // y sin - radius cos cos(a) up and y cos + radius sin cos(a) outward. Sideways, the greatest
    // of p cos(a) + q |sin(a)| is hypot(p, q); upward, a convex function of cos(a) is greatest at
    // an end.
    distance = std::max(distance, at.y * cos + radius * std::hypot(sin, 1 / tan_x));
    for (const float out : {-radius, radius}) {
      distance =
          std::max(distance, at.y * cos + out * sin + std::fabs(at.y * sin - out * cos) / tan_y);
    }
  }
  return {distance, center};
}

}  // namespace core
