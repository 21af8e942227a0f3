#include "core/scene/ground.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/math/numbers.h"
#include "core/scene/drawn.h"

namespace core {
namespace {

/// A surface swept between two directions: columns along `across`, rows along a profile in the
/// plane of `along` and up.
struct Strip {
  Vec3 center;
  Vec3 across;  ///< unit
  Vec3 along;   ///< unit, horizontal
};

/// A point of a profile: position along, height, and the angle by which its normal leans back.
struct ProfilePoint {
  float along = 0;
  float up = 0;
  float angle_rad = 0;
};

PrimitiveDescription extruded(const Strip& strip, const std::vector<float>& columns,
                              const std::vector<ProfilePoint>& profile) {
  PrimitiveDescription out;
  for (const ProfilePoint& p : profile) {
    for (const float x : columns) {
      out.positions.push_back(strip.center + strip.across * x + strip.along * p.along +
                              Vec3{0, p.up, 0});
      out.normals.push_back(Vec3{0, std::cos(p.angle_rad), 0} -
                            strip.along * std::sin(p.angle_rad));
    }
  }
  const auto width = static_cast<std::uint32_t>(columns.size());
  for (std::uint32_t row = 0; row + 1 < profile.size(); ++row) {
    for (std::uint32_t column = 0; column + 1 < width; ++column) {
      const std::uint32_t a = row * width + column;
      // Counter-clockwise seen from above, because across x up is opposite to along.
      for (const std::uint32_t v : {a, a + 1, a + width, a + 1, a + width + 1, a + width}) {
        out.indices.push_back(v);
      }
    }
  }
  return out;
}

/// Returns steps outwards from the centre, each twice the previous one: triangles are small under
/// the model, which keeps points on them accurate.
std::vector<float> doubling(float first, float last) {
  std::vector<float> out = {0};
  for (float at = first; at < last; at *= 2) {
    out.push_back(at);
    out.insert(out.begin(), -at);
  }
  out.push_back(last);
  out.insert(out.begin(), -last);
  return out;
}

}  // namespace

void add_ground(SceneDescription& scene, const GroundSettings& settings, Vec3 view_direction) {
  if (settings.type == GroundType::kNone) {
    return;
  }
  const Bounds bounds = bounds_of(scene);
  const float radius = bounds.radius_or(1);
  // Slightly below the model, which may have a floor of its own.
  constexpr float kGap = 1e-4F;
  const float height =
      settings.height_m
          ? static_cast<float>(static_cast<double>(*settings.height_m) - scene.origin.y)
          : (bounds.empty() ? 0.0F : bounds.min.y - kGap * radius);
  Vec3 center = bounds.empty() ? Vec3{} : bounds.center();
  center.y = height;
  const Vec3 level = {view_direction.x, 0, view_direction.z};
  // Seen from straight above, "behind" is -z. A catcher has no "behind".
  const bool has_behind = settings.type == GroundType::kSweep && length(level) > 1e-3F;
  const Vec3 along = has_behind ? normalize(level) : Vec3{0, 0, -1};
  const Strip strip = {center, cross(along, Vec3{0, 1, 0}), along};
  std::vector<ProfilePoint> profile;
  if (settings.type == GroundType::kCatcher) {
    // Light from below the horizon of its edge is 1e-6 of that of a uniform sky.
    constexpr float kExtent = 1024;
    for (const float at : doubling(radius, kExtent * radius)) {
      profile.push_back({at, 0, 0});
    }
    scene.meshes.push_back(
        {"ground", {extruded(strip, doubling(radius, kExtent * radius), profile)}});
  } else {
    // In radii of the model: floor to the front and the sides, its end behind, the curve, the wall.
    constexpr float kFloor = 16;
    constexpr float kBehind = 2;
    constexpr float kCurve = 2;
    constexpr float kWall = 16;
    constexpr int kCurveSteps = 32;
    for (const float at : {-kFloor, -8.0F, -4.0F, -2.0F, -1.0F, 0.0F, 1.0F}) {
      profile.push_back({at * radius, 0, 0});
    }
    for (int i = 0; i <= kCurveSteps; ++i) {
      const float angle = 0.5F * kPi * static_cast<float>(i) / kCurveSteps;
      profile.push_back({(kBehind + kCurve * std::sin(angle)) * radius,
                         kCurve * (1 - std::cos(angle)) * radius, angle});
    }
    profile.push_back({(kBehind + kCurve) * radius, kWall * radius, 0.5F * kPi});
    scene.meshes.push_back(
        {"ground", {extruded(strip, doubling(radius, kFloor * radius), profile)}});
  }
  MaterialDescription material;
  material.name = "ground";
  material.base_color = settings.color;
  material.metallic = 0;
  material.specular = 0;  // diffuse below the coat
  material.clearcoat = settings.reflection;
  material.double_sided = true;
  scene.meshes.back().primitives[0].material = static_cast<int>(scene.materials.size());
  scene.materials.push_back(std::move(material));
  InstanceDescription instance;
  instance.mesh = static_cast<int>(scene.meshes.size()) - 1;
  instance.is_ground = true;
  scene.instances.push_back(std::move(instance));
}

}  // namespace core
