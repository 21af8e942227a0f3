// Irradiance under simple emitters (truths 4 to 8), and absorption in solid glass.
#include <numbers>

#include "core/math/numbers.h"
#include "tests/render/truth.h"

namespace {

using core::Rgb;
using core::Strategy;
using test_support::expect_truth;
using test_support::glass;

constexpr double kPi = std::numbers::pi;

/// A white floor at y = 0 seen only at the origin, under `light`.
core::View meter(std::vector<core::PrimitiveDescription> light) {
  light.push_back(test_support::quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 0));
  core::View view = test_support::view_of(
      test_support::scene_of({test_support::lambert(Rgb(1)), test_support::emitter(Rgb(1))},
                             std::move(light)),
      32, 32);
  test_support::look_at(view, {0.3F, 0.4F, 0.5F}, {0, 0, 0}, 0.001F);
  view.settings.max_depth = 1;
  return view;
}

// Truth 4. The image is E / pi. Strategies that do not sample the light are noisy: their cap is
// four standard errors.
TEST(Irradiance, SquareDiskAndSphereMatchTheClosedForm) {
  struct Light {
    const char* name;
    std::vector<core::PrimitiveDescription> parts;
    double truth;
  };
  const Light lights[] = {
      {"square", {test_support::quad({-0.5F, 1, -0.5F}, {1, 0, 0}, {0, 0, 1}, 1)}, 0.7522747},
      {"disk", {test_support::disk({0, 1, 0}, 0.5F, 1)}, kPi / 5},
      {"sphere", {test_support::sphere({0, 1, 0}, 0.5F, 100, false, 1)}, kPi / 4},
  };
  core::View views[] = {meter(lights[0].parts), meter(lights[1].parts), meter(lights[2].parts)};
  std::size_t turn = 0;  // Each variant is lit by one of them.
  for (const auto& v : test_support::variants()) {
    core::View& view = views[turn % 3];
    const Light& light = lights[turn++ % 3];
    test_support::apply(v, view);
    const bool blind =
        v.estimator.strategy != Strategy::kMis && v.estimator.strategy != Strategy::kLight;
    // Line segments and triangles approximate curves: 2e-4 for the sphere.
    expect_truth(test_support::render(view, blind ? 64 : 32), light.truth / kPi, 5e-4,
                 light.name + (" " + v.name), 2e-4, blind ? 0.02 : 4e-3);
  }
}

// Truth 5: unit squares, seen from above with parallel rays; the image is F itself.
core::View plates(const core::PrimitiveDescription& lamp) {
  core::SceneDescription scene =
      test_support::scene_of({test_support::lambert(Rgb(1)), test_support::emitter(Rgb(1))},
                             {test_support::quad({0, 0, 1}, {1, 0, 0}, {0, 0, -1}, 0), lamp});
  core::CameraDescription camera;
  camera.orthographic = true;
  camera.x_magnification = camera.y_magnification = 0.5F;
  camera.to_world = {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}, {0.5F, 0.5F, 0.5F}};  // looks down
  scene.cameras.push_back(camera);
  core::View view = test_support::view_of(std::move(scene), 64, 64);
  view.settings.max_depth = 1;
  return view;
}

TEST(FormFactor, ParallelAndAdjacentUnitSquaresMatchTheClosedForm) {
  expect_truth(
      test_support::render(plates(test_support::quad({0, 1, 0}, {1, 0, 0}, {0, 0, 1}, 1)), 128),
      0.199825, 1e-3, "parallel");
  expect_truth(
      test_support::render(plates(test_support::quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1)), 128),
      0.200044, 1e-3, "adjacent");
}

core::View under_sky(std::shared_ptr<const core::Environment> sky) {
  core::View view = meter({});
  view.environment = std::move(sky);
  return view;
}

// Truth 6.
TEST(Irradiance, ConstantSkyMatchesTheClosedForm) {
  core::View view = under_sky(test_support::constant_sky(Rgb(1)));
  for (const auto& v : test_support::variants()) {
    test_support::apply(v, view);
    // Pixels that share light samples have noise in common.
    const bool shares = light_reuse(v.light_sampler) == core::LightReuse::kShare;
    expect_truth(test_support::render(view, 128), 1, shares ? 1.5e-3 : 5e-4, v.name);
  }
}

TEST(Irradiance, CosineSkyMatchesTheClosedForm) {
  // Texels hold the cosine-weighted mean of cos(theta) over their area, so the integral is exact: 2
  // pi / 3.
  constexpr int kRows = 64;
  const auto row = [](int y) {
    const double c0 = std::cos(kPi * y / kRows);
    const double c1 = std::cos(kPi * (y + 1) / kRows);
    return y >= kRows / 2 ? 0.0 : 2.0 / 3 * (c0 * c0 * c0 - c1 * c1 * c1) / (c0 * c0 - c1 * c1);
  };
  core::View view = under_sky(test_support::sky_map(
      128, kRows, [&](int, int y) { return Rgb(static_cast<float>(row(y))); }));
  for (const auto& v : test_support::variants()) {
    test_support::apply(v, view);
    expect_truth(test_support::render(view, 32), 2.0 / 3, 5e-4, v.name, 0, 2e-3);
  }
}

TEST(Irradiance, OneBrightTexelMatchesTheClosedForm) {
  constexpr int kWidth = 32;
  constexpr int kHeight = 16;
  for (const int bright : {0, 3, 7}) {
    const double t1 = kPi * bright / kHeight;
    const double t2 = kPi * (bright + 1) / kHeight;
    const double e =
        2 * kPi / kWidth * 0.5 * (std::sin(t2) * std::sin(t2) - std::sin(t1) * std::sin(t1));
    core::View view = under_sky(test_support::sky_map(
        kWidth, kHeight, [&](int x, int y) { return Rgb(x == 11 && y == bright ? 1.0F : 0.0F); }));
    for (const auto& v : test_support::variants()) {
      test_support::apply(v, view);
      const bool is_noisy = v.sampler == core::SamplerType::kIndependent ||
                            v.estimator.roulette == core::RouletteType::kThreshold;
      expect_truth(test_support::render(view, is_noisy ? 128 : 64), e / kPi, 5e-4,
                   v.name + " row " + std::to_string(bright), 0,
                   test_support::is_blind(v)            ? 0.5
                   : test_support::culls_shadow_rays(v) ? 0.1
                                                        : 2e-3);
    }
  }
}

// Truth 7: no noise at all.
TEST(Punctual, PointSpotAndSunOnLambertMatchTheClosedForm) {
  struct Case {
    const char* name;
    core::PunctualLightDescription light;
    double truth;
  };
  std::vector<Case> cases;
  core::PunctualLightDescription light;
  light.intensity = Rgb(3);
  light.to_world = core::translation({0, 2, 0});
  cases.push_back({"point above", light, 3.0 / 4});
  light.to_world = core::translation({1, 1, 0});
  cases.push_back({"point at 45 degrees", light, 3.0 / 2 * std::sqrt(0.5)});
  light.range_m = 2;
  cases.push_back(
      {"point with range 2", light, 3.0 / 2 * std::sqrt(0.5) * (1 - 0.25)});  // 1 - (d / range)^4
  light.range_m = 0;
  light.type = core::PunctualType::kSpot;
  light.inner_cone_rad = 0.2F;
  light.outer_cone_rad = 0.6F;
  light.to_world = {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}, {0, 2, 0}};  // its -z points down
  cases.push_back({"spot on its axis", light, 3.0 / 4});
  // 0.4 rad off the axis: KHR_lights_punctual's squared ramp between the cosines.
  const double tilt = 0.4;
  const auto c = static_cast<float>(std::cos(tilt));
  const auto s = static_cast<float>(std::sin(tilt));
  light.to_world = {{c, s, 0}, {0, 0, -1}, {-s, c, 0}, {0, 2, 0}};
  const double ramp = (std::cos(tilt) - std::cos(0.6)) / (std::cos(0.2) - std::cos(0.6));
  cases.push_back({"spot off its axis", light, 3.0 / 4 * ramp * ramp});
  light = {};
  light.type = core::PunctualType::kDirectional;
  light.intensity = Rgb(3);
  const double turn = 0.7;
  light.to_world = {{1, 0, 0},
                    {0, static_cast<float>(std::sin(turn)), static_cast<float>(-std::cos(turn))},
                    {0, static_cast<float>(std::cos(turn)), static_cast<float>(std::sin(turn))},
                    {}};
  cases.push_back({"sun", light, 3 * std::cos(turn)});
  for (const Case& test : cases) {
    core::SceneDescription scene =
        test_support::scene_of({test_support::lambert({1, 0.5F, 0.25F})},
                               {test_support::quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 0)});
    scene.lights.push_back(test.light);
    core::View view = test_support::view_of(std::move(scene), 4, 4);
    test_support::look_at(view, {0.3F, 0.4F, 0.5F}, {0, 0, 0}, 2e-5F);
    for (const auto& v : test_support::variants()) {
      test_support::apply(v, view);
      if (test_support::culls_shadow_rays(v)) {
        expect_truth(test_support::render(view, 4096), 0.5 * test.truth / kPi, 5e-4,
                     test.name + (" " + v.name), 0, 0.02);
        continue;
      }
      const Rgb mean = test_support::render(view, 4).mean();
      EXPECT_NEAR(mean.r, test.truth / kPi, 3e-6 * test.truth) << test.name << " " << v.name;
      EXPECT_NEAR(mean.b, 0.25 * test.truth / kPi, 3e-6 * test.truth) << test.name << " " << v.name;
    }
  }
}

/// A point light of range 2.5 m, 2 m above a unit square and 0.5 m above a pane with null
/// scattering; seen from above, below the pane.
core::View under_a_pane() {
  core::MaterialDescription clear = glass(1, 0);
  core::SceneDescription scene =
      test_support::scene_of({test_support::lambert(Rgb(1)), clear},
                             {test_support::quad({-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, 0),
                              test_support::quad({-3, 1.5F, 3}, {6, 0, 0}, {0, 0, -6}, 1)});
  core::PunctualLightDescription light;
  light.intensity = Rgb(3);
  light.range_m = 2.5F;
  light.to_world = core::translation({0, 2, 0});
  scene.lights.push_back(light);
  core::CameraDescription camera;
  camera.orthographic = true;
  camera.x_magnification = camera.y_magnification = 0.5F;
  camera.to_world = {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}, {0, 1, 0}};  // looks down
  scene.cameras.push_back(camera);
  core::View view = test_support::view_of(std::move(scene), 32, 32);
  view.settings.max_depth = 1;
  return view;
}

/// Mean radiance of that square by the midpoint rule; range factor at the fraction `share` of the
/// distance.
double mean_under_a_pane(double share) {
  constexpr int kCells = 200;
  double sum = 0;
  for (int i = 0; i < kCells * kCells; ++i) {
    const double x = (i % kCells + 0.5) / kCells - 0.5;
    const double z = (i / kCells + 0.5) / kCells - 0.5;
    const double d2 = x * x + z * z + 4;
    const double q = share * share * d2 / (2.5 * 2.5);
    sum += 3 * 2 / (d2 * std::sqrt(d2)) * (1 - q * q) / kPi;
  }
  return sum / (kCells * kCells);
}

// Three means at 4 standard errors, a chance of 2e-4, plus 1e-5 for the midpoint rule and float
// rounding. Light tracing estimates a mean to 1%; a range evaluated at the pane, at a quarter of
// the distance, would make it 1.7 times as bright.
TEST(Punctual, RangeEndsAtTheFirstScatteringSurface) {
  core::View view = under_a_pane();
  for (const char* integrator : {"path", "light-trace", "bdpt"}) {
    view.settings.integrator = integrator;
    const test_support::Picture picture = test_support::render(view, 512);
    const auto mean = static_cast<double>(picture.mean().g);
    const auto error = static_cast<double>(picture.standard_error().g);
    EXPECT_LT(std::fabs(mean - mean_under_a_pane(1)), 4 * error + 1e-5 * mean) << integrator;
    EXPECT_GT(std::fabs(mean - mean_under_a_pane(0.25)), 10 * error) << integrator;
  }
}

/// A closed slab between z = -1/2 and z = 1/2, seen along -z.
core::View slab(const core::MaterialDescription& material, float side_m = 100) {
  const float s = side_m;
  core::View view = test_support::view_of(
      test_support::scene_of(
          {material}, {test_support::quad({-s / 2, -s / 2, 0.5F}, {s, 0, 0}, {0, s, 0}, 0),
                       test_support::quad({-s / 2, -s / 2, -0.5F}, {0, s, 0}, {s, 0, 0}, 0)}),
      32, 32);
  test_support::look_at(view, {0, 0, 3}, {0, 0, 0}, 0.01F);
  return view;
}

// Truth 8: the slab reflects 2R / (1 + R) of the front half of the sky and transmits the rest from
// the back.
TEST(Slab, ReflectsTheSumOfAllBounces) {
  core::View view = slab(glass(1.5F));
  view.settings.max_depth = 64;
  view.environment = test_support::sky_map(4, 2, [](int x, int) {
    // u = 0.5 + atan2(z, x) / 2 pi: +z is the second half of the map.
    return x >= 2 ? Rgb{0, 1, 0} : Rgb{1, 0, 0};
  });
  const auto picture = test_support::render(view, 1024);
  expect_truth(picture, 0.0769231, 5e-3, "slab");
  EXPECT_NEAR(picture.mean().r, 1 - 0.0769231, 4 * static_cast<double>(picture.standard_error().r));
}

/// Reflectance of a face of index 1.5 as glTF has it: Schlick's, from 0.04. Source: glTF 2.0 B.2.2.
double wall_face(double cos_i) { return 0.04 + 0.96 * std::pow(1 - cos_i, 5); }

/// Radiance of a Lambertian floor of albedo 1 at (x, z) under an emitter of unit radiance and side
/// 1 m, 1 m above it, whose light passes both faces of a clear thin wall: the midpoint rule over
/// the emitter.
double through_a_wall(double x, double z) {
  constexpr int kCells = 160;
  double sum = 0;
  for (int i = 0; i < kCells * kCells; ++i) {
    const double dx = (i % kCells + 0.5) / kCells - 0.5 - x;
    const double dz = (i / kCells + 0.5) / kCells - 0.5 - z;
    const double cos2 = 1 / (dx * dx + dz * dz + 1);
    const double f = wall_face(std::sqrt(cos2));
    sum += cos2 * cos2 * (1 - f) / (1 + f);
  }
  return sum / (kCells * kCells * kPi);
}

/// Radiance at the origin of the light that a floor of side 2 m scatters up to that wall, half a
/// metre above it, whose faces return 2F / (1 + F): from the floor's image, 1 m above.
double returned_by_a_wall() {
  constexpr int kCells = 20;
  double sum = 0;
  for (int i = 0; i < kCells * kCells; ++i) {
    const double x = 2 * (i % kCells + 0.5) / kCells - 1;
    const double z = 2 * (i / kCells + 0.5) / kCells - 1;
    const double cos2 = 1 / (x * x + z * z + 1);
    const double f = wall_face(std::sqrt(cos2));
    sum += 4 * through_a_wall(x, z) * cos2 * cos2 * 2 * f / (1 + f);
  }
  return sum / (kCells * kCells * kPi);
}

// A clear thin wall between floor and light, the same for every strategy; light sampling and BSDF
// sampling share the transmitted light by MIS. The third scattering event adds the light that the
// wall returns to the floor, 2.9%.
TEST(ClearWall, TransmitsLightForEveryStrategyAndDepth) {
  core::MaterialDescription wall = glass(1.5F, 0);
  wall.double_sided = true;
  core::View view = test_support::view_of(
      test_support::scene_of({test_support::lambert(Rgb(1)), test_support::emitter(Rgb(1)), wall},
                             {test_support::quad({-0.5F, 1, -0.5F}, {1, 0, 0}, {0, 0, 1}, 1),
                              test_support::quad({-5, 0.5F, -5}, {10, 0, 0}, {0, 0, 10}, 2),
                              test_support::quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 0)}),
      32, 32);
  test_support::look_at(view, {0.3F, 0.4F, 0.3F}, {0, 0, 0}, 0.001F);
  const double direct = through_a_wall(0, 0);
  const double returned = returned_by_a_wall();
  for (const int depth : {1, 2, 3}) {
    view.settings.max_depth = depth;
    const double truth = depth < 3 ? direct : direct + returned;
    for (const auto& v : test_support::variants()) {
      test_support::apply(v, view);
      expect_truth(test_support::render(view, 32), truth, 8e-3,
                   v.name + " depth " + std::to_string(depth), 1e-4,
                   test_support::is_blind(v) ? 0.05 : 0);
    }
  }
}

// Absorption only: matched indices reflect nothing, so there is no noise.
TEST(BeerLambert, HoldsInSolidGlassOfMatchedIndex) {
  core::MaterialDescription m = glass(1);
  m.attenuation_distance = 2;
  m.attenuation_color = {0.25F, 0.5F, 0.8F};
  // Rays leave surfaces by their rounding, which grows with the triangle: 1e-6 m for sides of 1 m.
  core::View view = slab(m, 1);
  view.environment = test_support::constant_sky(Rgb(1));
  const Rgb mean = test_support::render(view, 4).mean();
  // The path is 1 m less the offsets of two rays, plus the obliqueness of the pixel.
  EXPECT_NEAR(mean.r, std::sqrt(0.25), 5e-6);
  EXPECT_NEAR(mean.g, std::sqrt(0.5), 5e-6);
  EXPECT_NEAR(mean.b, std::sqrt(0.8), 5e-6);
}

// Passing a boundary of equal indices is no scattering event.
TEST(BeerLambert, BoundariesOfEqualIndexDoNotCountAsDepth) {
  core::MaterialDescription m = glass(1);
  core::View view = slab(m);
  view.environment = test_support::constant_sky(Rgb(1));
  view.settings.max_depth = 0;
  EXPECT_NEAR(test_support::render(view, 2).mean().g, 1, 1e-6);
}

TEST(BeerLambert, HoldsForACameraInsideTheGlass) {
  core::MaterialDescription m = glass(1);
  m.attenuation_distance = 1;
  m.attenuation_color = {0.25F, 0.5F, 0.8F};
  core::View view = slab(m);
  test_support::look_at(view, {0, 0, 0.25F}, {0, 0, 0}, 0.01F);  // 0.75 m of glass ahead
  view.environment = test_support::constant_sky(Rgb(1));
  EXPECT_NEAR(test_support::render(view, 4).mean().g, std::pow(0.5, 0.75), 5e-6);
}

}  // namespace
