// Small things on large triangles: contact and shadow have their closed form, whatever the size of
// the triangle.
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/integrators/registry.h"
#include "tests/support/scenes.h"

namespace {

using core::PrimitiveDescription;
using core::Rgb;
using core::Vec3;

/// Share of diffuse light that a wall on the ground keeps from a point of the ground. Source:
/// Howell, A Catalog of Radiation Heat Transfer Configuration Factors, B-4: from an element to a
/// perpendicular rectangle; here two of them, from the middle of the wall's foot.
double share_of_wall(double distance_m, double height_m, double half_width_m) {
  const double x = height_m / half_width_m;
  const double y = distance_m / half_width_m;
  const double r = std::hypot(x, y);
  return (std::atan(1 / y) - y / r * std::atan(1 / r)) / std::numbers::pi;
}

constexpr float kHeight_m = 0.02F;
constexpr float kHalfWidth_m = 0.01F;
constexpr float kDistance_m = 0.004F;

/// A black wall in the middle of a grey ground, under a white sky, turned about z; seen where the
/// ground is kDistance_m from the wall.
core::View wall_on_ground(float half_m, float angle_rad, bool instanced) {
  const core::Transform turn =
      core::rotation({0, 0, std::sin(angle_rad / 2), std::cos(angle_rad / 2)});
  const auto turned = [&](Vec3 at) { return turn.vector(at); };
  core::SceneDescription scene = test_support::scene_of(
      {test_support::lambert(Rgb(0.5F)), test_support::lambert(Rgb(0))},
      {test_support::quad(turned({-half_m, 0, -half_m}), turned({0, 0, 2 * half_m}),
                          turned({2 * half_m, 0, 0}), 0)});
  scene.meshes.push_back(
      {"",
       {test_support::quad(turned({0, 0, -kHalfWidth_m}), turned({0, 0, 2 * kHalfWidth_m}),
                           turned({0, kHeight_m, 0}), 1)}});
  for (int i = 0; i < (instanced ? 2 : 1); ++i) {
    core::InstanceDescription instance;
    instance.mesh = 1;
    instance.to_world = core::translation(turned({0, 0, static_cast<float>(i)}));
    scene.instances.push_back(instance);
  }
  core::View view = test_support::view_of(std::move(scene), 4, 4);
  test_support::look_at(view, turned({kDistance_m + 0.05F, 0.05F, 0}), turned({kDistance_m, 0, 0}),
                        0.2F);
  view.environment = test_support::constant_sky(Rgb(1));
  return view;
}

// At 10 km, where a step off the ground's triangle would be as high as the wall, half of the shadow
// is missing if it is not divided.
TEST(DivideTriangles, AWallOfCentimetresShadesAGroundOfAnySize) {
  const double expected = 0.5 * (1 - share_of_wall(kDistance_m, kHeight_m, kHalfWidth_m));
  for (const float half_m : {0.5F, 1000.0F, 1e4F, 1e5F}) {
    for (const float angle_rad : {0.0F, 0.6F}) {
      for (const bool instanced : {false, true}) {
        core::View view = wall_on_ground(half_m, angle_rad, instanced);
        EXPECT_EQ(view.scene->summary().triangles, instanced ? 6 : 4) << "as in the file";
        EXPECT_NEAR(test_support::render(view, 1024).mean().g, expected, 0.01)
            << half_m << " m, turned by " << angle_rad << (instanced ? ", an instance" : "");
      }
    }
  }
}

TEST(DivideTriangles, InEveryIntegrator) {
  const double expected = 0.5 * (1 - share_of_wall(kDistance_m, kHeight_m, kHalfWidth_m));
  core::View view = wall_on_ground(1e4F, 0, false);
  for (const core::IntegratorEntry& row : core::integrators()) {
    if (row.name == core::kAutomaticIntegrator || row.splats) {
      continue;  // particles find little of the image
    }
    const core::FilmSettings film = view.settings.film;
    view.settings = core::default_settings(row.name);
    view.settings.film = film;
    view.settings.photons.paths = 100;
    EXPECT_NEAR(test_support::render(view, 256).mean().g, expected, 0.02) << row.name;
  }
}

}  // namespace
