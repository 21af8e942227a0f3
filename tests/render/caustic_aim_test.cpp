// Where the light paths of path-caustics are aimed.
#include "core/integrators/bidirectional/caustic_aim.h"

#include <gtest/gtest.h>

#include "core/render/task/settle.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::AimPoint;
using core::EmissionTarget;
using core::Rgb;
using core::Vec3;

TEST(BallsAround, ContainThePointsAndShareByWeight) {
  test_support::Random random(3);
  std::vector<AimPoint> points;
  double right = 0;  // weight where x > 10
  double total = 0;
  for (int i = 0; i < 1000; ++i) {
    const float x = i % 4 == 0 ? 20.0F : 0.0F;
    points.push_back(
        {{x + random.uniform(), random.uniform(), random.uniform()}, 1 + random.uniform()});
    total += static_cast<double>(points.back().weight);
    right += x > 0 ? static_cast<double>(points.back().weight) : 0;
  }
  const std::vector<EmissionTarget> balls = core::balls_around(points, 0.6F);
  ASSERT_EQ(balls.size(), 8);
  double sum = 0;
  double on_the_right = 0;
  for (const EmissionTarget& ball : balls) {
    sum += static_cast<double>(ball.share);
    on_the_right += ball.center.x > 10 ? static_cast<double>(ball.share) : 0;
  }
  EXPECT_NEAR(sum, 0.6, 1e-5);
  EXPECT_NEAR(on_the_right / sum, right / total, 0.04) << "a ball of 7 may hold both";
  for (const AimPoint& point : points) {
    bool is_inside = false;
    for (const EmissionTarget& ball : balls) {
      is_inside |= length(point.position - ball.center) <= ball.radius_m * 1.0001F;
    }
    EXPECT_TRUE(is_inside);
  }
  EXPECT_TRUE(core::balls_around({}, 0.6F).empty());
  EXPECT_TRUE(core::balls_around({{{1, 1, 1}, 0}}, 0.6F).empty());
}

/// A glass ball of 2 cm on a floor of 20 m, seen from nearby, under the sun, a sky, a lamp, or a
/// panel, and another lamp far away.
enum class Light { kSun, kSky, kLamp, kPanel };

core::View small_ball(Light light) {
  std::vector<core::PrimitiveDescription> things = {
      test_support::quad({-10, 0, 10}, {20, 0, 0}, {0, 0, -20}, 0),
      test_support::sphere({0, 0.03F, 0}, 0.02F, 16, false, 1)};
  if (light == Light::kPanel) {
    things.push_back(test_support::quad({-0.1F, 2, -0.1F}, {0.2F, 0, 0}, {0, 0, 0.2F}, 2));
  }
  core::SceneDescription scene = test_support::scene_of(
      {test_support::lambert(Rgb(0.6F)), test_support::glass(), test_support::emitter(Rgb(5))},
      std::move(things));
  if (light == Light::kSun) {
    scene.lights.push_back(
        test_support::directional({{1, 0, 0}, {0, 0, -1}, {0, 1, 0}, {}}, Rgb(3)));
  }
  if (light == Light::kLamp) {
    core::PunctualLightDescription lamp;
    lamp.to_world = core::translation({0, 2, 0});
    scene.lights.push_back(lamp);
    lamp.to_world = core::translation({8, 1, 8});
    scene.lights.push_back(lamp);
  }
  core::View view = test_support::view_of(std::move(scene), 64, 64);
  if (light == Light::kSky) {
    view.environment = test_support::constant_sky(Rgb(1));
  }
  test_support::look_at(view, {0, 0.2F, 0.3F}, {0, 0, 0}, 40);
  view.settings.integrator = "path-caustics";
  return view;
}

/// The fraction of light paths that first meet the ball.
double on_ball(const core::View& view, const core::EmissionSampler& emission) {
  test_support::Random random(5);
  constexpr int kPaths = 20000;
  int met = 0;
  for (int i = 0; i < kPaths; ++i) {
    const float u = random.uniform();
    const core::Vec2 position = random.uniform_2d();
    const auto ray = emission.sample(u, position, random.uniform_2d()).ray;
    core::RawHit hit;
    if (view.scene->data().accel->intersect(ray, hit)) {
      const Vec3 at = view.scene->data().surface_point(hit, ray).position;
      met += length(at - Vec3{0, 0.03F, 0}) < 0.021F ? 1 : 0;
    }
  }
  return static_cast<double>(met) / kPaths;
}

// Half of the paths is aimed, and a part of the balls around the glass is beside it. Half
// of the sky is below the floor.
TEST(CausticAim, LightPathsMeetTheGlassOfAVisibleCaustic) {
  for (const Light light : {Light::kSun, Light::kSky, Light::kLamp, Light::kPanel}) {
    SCOPED_TRACE(static_cast<int>(light));
    core::View view = small_ball(light);
    const auto camera = core::camera_of(view);
    ASSERT_TRUE(camera);
    core::EmissionSampler emission(view.scene->data(), view.environment.get());
    EXPECT_LT(on_ball(view, emission), 0.001) << "not aimed";
    core::aim_at_caustics(
        {view.scene->data(), view.environment.get(), view.settings, &camera->first()}, emission);
    EXPECT_GT(on_ball(view, emission), light == Light::kSky ? 0.14 : 0.27);
  }
}

/// A lamp above a thick pane above a floor, which is wider than what the lamp lights through it.
core::View below_a_pane(core::MaterialDescription pane) {
  core::SceneDescription scene =
      test_support::scene_of({test_support::lambert(Rgb(0.2F)), std::move(pane)},
                             {test_support::quad({-4, 0, 4}, {8, 0, 0}, {0, 0, -8}, 0),
                              test_support::box({0, 1.05F, 0}, {4, 0.05F, 4}, 0, 1)});
  core::PunctualLightDescription lamp;
  lamp.to_world = core::translation({0, 2, 0});
  scene.lights.push_back(lamp);
  core::View view = test_support::view_of(std::move(scene), 64, 64);
  test_support::look_at(view, {0, 0.9F, 1}, {0, 0, 0}, 60);
  view.settings.integrator = "path-caustics";
  return view;
}

double caustics(const core::View& view) {
  const auto camera = core::camera_of(view);
  core::EmissionSampler emission(view.scene->data(), nullptr);
  return core::aim_at_caustics({view.scene->data(), nullptr, view.settings, &camera->first()},
                               emission);
}

// The floor returns a fifth of the light, of which a pane reflects a sixth at most: 4%.
TEST(CausticAim, ReturnsTheFractionOfLightThatIsCaustics) {
  EXPECT_GT(caustics(below_a_pane(test_support::glass())), 0.96);
  core::MaterialDescription milky = test_support::lambert(Rgb(0.5F));
  milky.diffuse_transmission = 1;
  EXPECT_EQ(caustics(below_a_pane(milky)), 0) << "the pane scatters widely";
}

}  // namespace
