#include "tests/bench/caustic_views.h"

#include <array>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/lights/made_environment.h"
#include "core/math/numbers.h"
#include "tests/support/scenes.h"

namespace bench {
namespace {

using core::Rgb;
using core::Vec3;

/// A point of an outline and its outward normal: both in the plane of radius and height.
struct Outline {
  float radius, height, normal_radius, normal_height;
};

/// A solid of revolution around the y axis. Edges have two points.
core::PrimitiveDescription revolved(std::span<const Outline> outline, int material) {
  constexpr std::uint32_t kAround = 96;
  core::PrimitiveDescription out;
  out.material = material;
  for (std::uint32_t i = 0; i < kAround; ++i) {
    const float phi = core::kTwoPi * static_cast<float>(i) / kAround;
    const float c = std::cos(phi);
    const float s = std::sin(phi);
    for (const Outline& at : outline) {
      out.positions.push_back({at.radius * c, at.height, at.radius * s});
      out.normals.push_back({at.normal_radius * c, at.normal_height, at.normal_radius * s});
    }
  }
  const auto count = static_cast<std::uint32_t>(outline.size());
  for (std::uint32_t i = 0; i < kAround; ++i) {
    const std::uint32_t next = (i + 1) % kAround;
    for (std::uint32_t k = 0; k + 1 < count; ++k) {
      const std::uint32_t a = i * count + k;
      const std::uint32_t d = next * count + k;
      if (outline[k].radius > 0) {
        out.indices.insert(out.indices.end(), {a, a + 1, d});
      }
      if (outline[k + 1].radius > 0) {
        out.indices.insert(out.indices.end(), {a + 1, d + 1, d});
      }
    }
  }
  return out;
}

/// Flat polygons that fan out from their first corners.
core::PrimitiveDescription faceted(std::span<const std::vector<Vec3>> polygons, int material) {
  core::PrimitiveDescription out;
  out.material = material;
  for (const std::vector<Vec3>& polygon : polygons) {
    const auto first = static_cast<std::uint32_t>(out.positions.size());
    out.positions.insert(out.positions.end(), polygon.begin(), polygon.end());
    for (std::uint32_t i = 1; i + 1 < polygon.size(); ++i) {
      out.indices.insert(out.indices.end(), {first, first + i, first + i + 1});
    }
  }
  return out;
}

/// A square table, at the height of 0.
core::PrimitiveDescription table(float half_m) {
  return test_support::quad({-half_m, 0, half_m}, {2 * half_m, 0, 0}, {0, 0, -2 * half_m}, 0);
}

std::shared_ptr<const core::Environment> sun_and_sky() {
  core::EnvironmentSettings settings;
  settings.sun = core::SunSettings{};
  settings.sun->latitude_degrees = 52.5;
  settings.sun->longitude_degrees = 13.4;
  settings.sun->unix_seconds = 1782028800;  // 2026-06-21, 10:00 in Berlin
  const auto sky = core::make_environment(settings);
  CHECK(sky);
  return *sky;
}

core::View view_of(std::vector<core::MaterialDescription> materials,
                   std::vector<core::PrimitiveDescription> things, int width, int height) {
  return test_support::view_of(test_support::scene_of(std::move(materials), std::move(things)),
                               width, height);
}

core::View water(int width, int height) {
  constexpr std::array<Outline, 10> kGlass = {{{0, 0.001F, 0, -1},
                                               {0.035F, 0.001F, 0, -1},
                                               {0.035F, 0.001F, 1, 0},
                                               {0.038F, 0.111F, 1, 0},
                                               {0.038F, 0.111F, 0, 1},
                                               {0.0355F, 0.111F, 0, 1},
                                               {0.0355F, 0.111F, -1, 0},
                                               {0.0325F, 0.009F, -1, 0},
                                               {0.0325F, 0.009F, 0, 1},
                                               {0, 0.009F, 0, 1}}};
  constexpr std::array<Outline, 6> kWater = {{{0, 0.0092F, 0, -1},
                                              {0.0323F, 0.0092F, 0, -1},
                                              {0.0323F, 0.0092F, 1, 0},
                                              {0.0344F, 0.081F, 1, 0},
                                              {0.0344F, 0.081F, 0, 1},
                                              {0, 0.081F, 0, 1}}};
  core::View view = view_of(
      {test_support::lambert(Rgb(0.6F)), test_support::glass(1.52F), test_support::glass(1.333F)},
      {table(0.6F), revolved(kGlass, 1), revolved(kWater, 2)}, width, height);
  view.environment = sun_and_sky();
  test_support::look_at(view, {0.05F, 0.2F, 0.35F}, {0, 0.04F, 0}, 38);
  return view;
}

core::View ring(int width, int height) {
  constexpr std::array<Outline, 8> kRing = {{{0.01F, 0.0002F, 0, -1},
                                             {0.011F, 0.0002F, 0, -1},
                                             {0.011F, 0.0002F, 1, 0},
                                             {0.011F, 0.006F, 1, 0},
                                             {0.011F, 0.006F, 0, 1},
                                             {0.01F, 0.006F, 0, 1},
                                             {0.01F, 0.006F, -1, 0},
                                             {0.01F, 0.0002F, -1, 0}}};
  core::MaterialDescription gold;
  gold.base_color = {1, 0.8F, 0.4F};
  gold.metallic = 1;
  gold.roughness = 0.05F;
  core::View view = view_of({test_support::lambert(Rgb(0.5F)), gold},
                            {table(0.3F), revolved(kRing, 1)}, width, height);
  view.environment = sun_and_sky();
  test_support::look_at(view, {0, 0.035F, 0.05F}, {0, 0, 0}, 35);
  return view;
}

/// A round brilliant with eight sides.
core::View diamond(int width, int height) {
  constexpr int kSides = 8;
  const auto around = [](float radius_m, float height_m, float turn) {
    const float phi = core::kTwoPi * turn / kSides;
    return Vec3{radius_m * std::cos(phi), height_m, radius_m * std::sin(phi)};
  };
  const Vec3 low = {0, 0.0002F, 0};
  std::vector<std::vector<Vec3>> faces(1);
  for (int i = 0; i < kSides; ++i) {
    const auto turn = static_cast<float>(i);
    const Vec3 here = around(0.01F, 0.0062F, turn);
    const Vec3 next = around(0.01F, 0.0062F, turn + 1);
    const Vec3 top = around(0.0057F, 0.0094F, turn + 0.5F);
    faces[0].insert(faces[0].begin(), top);
    faces.push_back({next, here, top});
    faces.push_back({top, around(0.0057F, 0.0094F, turn + 1.5F), next});
    faces.push_back({here, next, low});
  }
  core::View view =
      view_of({test_support::lambert(Rgb(0.5F)), test_support::glass(2.417F),
               test_support::emitter(Rgb(300))},
              {table(0.1F), faceted(faces, 1),
               test_support::quad({-0.066F, 0.15F, -0.006F}, {0.012F, 0, 0}, {0, 0, 0.012F}, 2)},
              width, height);
  test_support::look_at(view, {0.015F, 0.035F, 0.06F}, {0, 0.003F, 0}, 35);
  return view;
}

/// Ribs towards the wall, a lamp on the other side.
core::View ribbed(int width, int height) {
  constexpr int kSteps = 240;
  constexpr float kHalf = 0.3F;
  constexpr float kLow = 0.02F;
  constexpr float kHigh = 0.5F;
  constexpr float kFront = 0.1F;
  const auto back = [](int i, float y) {
    const float x = -kHalf + 2 * kHalf * static_cast<float>(i) / kSteps;
    return Vec3{x, y, 0.088F - 0.006F * std::cos(core::kTwoPi * x / 0.05F)};
  };
  const auto front = [&](int i, float y) {
    const Vec3 at = back(i, y);
    return Vec3{at.x, y, kFront};
  };
  std::vector<std::vector<Vec3>> faces = {
      {front(0, kLow), front(kSteps, kLow), front(kSteps, kHigh), front(0, kHigh)},
      {back(0, kLow), front(0, kLow), front(0, kHigh), back(0, kHigh)},
      {front(kSteps, kLow), back(kSteps, kLow), back(kSteps, kHigh), front(kSteps, kHigh)}};
  for (int i = 0; i < kSteps; ++i) {
    faces.push_back({back(i, kLow), back(i + 1, kLow), front(i + 1, kLow), front(i, kLow)});
    faces.push_back({back(i + 1, kHigh), back(i, kHigh), front(i, kHigh), front(i + 1, kHigh)});
  }
  core::PrimitiveDescription ribs;
  ribs.material = 1;
  for (std::uint32_t i = 0; i <= kSteps; ++i) {
    for (const float y : {kLow, kHigh}) {
      ribs.positions.push_back(back(static_cast<int>(i), y));
      const float slope =
          0.006F * core::kTwoPi / 0.05F * std::sin(core::kTwoPi * ribs.positions.back().x / 0.05F);
      ribs.normals.push_back(normalize(Vec3{slope, 0, -1}));
    }
    if (i < kSteps) {
      ribs.indices.insert(ribs.indices.end(),
                          {2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 1, 2 * i + 3, 2 * i + 2});
    }
  }
  core::SceneDescription scene = test_support::scene_of(
      {test_support::lambert(Rgb(0.7F)), test_support::glass()},
      {table(1), test_support::quad({-1, 0, -0.8F}, {2, 0, 0}, {0, 1.2F, 0}, 0), faceted(faces, 1),
       std::move(ribs)});
  core::PunctualLightDescription lamp;
  lamp.intensity = {40, 36, 28};
  lamp.to_world = core::translation({0, 0.3F, 0.35F});
  scene.lights.push_back(lamp);
  core::View view = test_support::view_of(std::move(scene), width, height);
  test_support::look_at(view, {0.5F, 0.7F, 1.3F}, {0, 0.25F, -0.3F}, 45);
  return view;
}

}  // namespace

std::optional<core::View> caustic_view(std::string_view name, int width, int height) {
  struct Row {
    std::string_view name;
    core::View (*make)(int width, int height);
  };
  constexpr std::array<Row, 4> kRows = {
      {{"water", water}, {"ring", ring}, {"diamond", diamond}, {"ribbed", ribbed}}};
  for (const Row& row : kRows) {
    if (row.name == name) {
      return row.make(width, height);
    }
  }
  return {};
}

}  // namespace bench
