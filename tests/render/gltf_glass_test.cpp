// Transmission and volume in glTF: transmitted fractions and absorbed colours. The false alarm rate
// of each z-test is that of 4.5 standard deviations, 7e-6.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/bsdf/thin_film.h"
#include "tests/render/gltf_stage.h"

namespace {

using core::Rgb;
using core::Vec3;
using test_support::glass;
using test_support::Picture;
using test_support::pixel;

constexpr double kPi = 3.14159265358979323846;
constexpr double kSigmas = 4.5;

void expect_mean(const Picture& picture, const double (&expected)[3], const char* what) {
  for (int c = 0; c < 3; ++c) {
    const auto error = static_cast<double>(picture.standard_error()[c]);
    EXPECT_NEAR(static_cast<double>(picture.mean()[c]), expected[c], kSigmas * error + 1e-5)
        << what << " " << c;
  }
}

/// What a thin wall of base colour c transmits, all reflections between its faces included, each of
/// which reflects f.
double through_wall(double f, double c) { return (1 - f) * (1 - f) * c / (1 - c * c * f * f); }

double schlick(double cosine) { return 0.04 + 0.96 * std::pow(1 - cosine, 5); }

TEST(GltfGlass, AThinPaneTintsACheckerboardBehindIt) {
  // Unlit squares behind a thin pane, undistorted, plus the reflection of the black sky.
  core::MaterialDescription pane = glass(1.5F, 0);
  pane.base_color = {0.9F, 0.5F, 0.25F};
  core::SceneDescription scene = test_support::stage(pane);
  core::MaterialDescription checker;
  checker.unlit = true;
  checker.base_color_texture.image = 0;
  checker.base_color_texture.nearest = true;
  scene.materials.push_back(checker);
  scene.meshes[0].primitives.push_back(test_support::patch(-1, 1));
  test_support::add_image(scene, 2, 2, 3, {255, 255, 255, 0, 0, 0, 0, 0, 0, 255, 255, 255});
  const Picture picture =
      test_support::shoot_glb(scene, {.width = 2, .height = 2, .samples = 4096, .depth = 4});
  for (int i = 0; i < 4; ++i) {
    const Rgb seen = pixel(picture, i % 2, i / 2);
    const bool white = i == 0 || i == 3;
    for (int c = 0; c < 3; ++c) {
      const auto expected =
          white ? through_wall(0.04, static_cast<double>(pane.base_color[c])) : 0.0;
      // The lobe is a Bernoulli variable with p near 0.95: 4.5 standard deviations of 4096 trials.
      EXPECT_NEAR(static_cast<double>(seen[c]), expected, 4.5 * 0.25 / 64) << i << " " << c;
    }
  }
}

/// A white floor of 2 m under a window 1 m above it, a camera between them, light from above.
core::SceneDescription under_window(const core::MaterialDescription& window) {
  core::SceneDescription scene = test_support::stage(test_support::lambert({1, 1, 1}));
  scene.materials.push_back(window);
  core::PrimitiveDescription pane = test_support::patch(1, 1);
  for (Vec3& p : pane.positions) {
    p = {p.x * 50, p.y * 50, p.z};
  }
  scene.meshes[0].primitives.push_back(pane);
  scene.cameras[0].to_world.t = {0, 0, 0.5F};
  return scene;
}

TEST(GltfGlass, ClearWindowsTransmitSunAndEmitters) {
  core::MaterialDescription window = glass(1.5F, 0);
  window.base_color = {1, 0.5F, 0.25F};
  for (const double theta : {0.0, 60.0}) {
    core::SceneDescription scene = under_window(window);
    const Vec3 wi = test_support::towards(theta);
    scene.lights.push_back(test_support::sun(wi, {1, 1, 1}));
    const double cosine = static_cast<double>(wi.z);
    const Rgb sun = pixel(test_support::shoot_glb(scene, {}), 4, 4);
    for (int c = 0; c < 3; ++c) {
      const double share = through_wall(schlick(cosine), static_cast<double>(window.base_color[c]));
      const double expected = share * cosine / kPi;
      EXPECT_NEAR(static_cast<double>(sun[c]), expected, 5e-4 * expected)
          << theta << " " << c;  // tables
    }
  }
  core::SceneDescription scene = under_window(window);
  core::PunctualLightDescription lamp;
  lamp.intensity = {4, 4, 4};
  lamp.to_world.t = {0, 0, 2};
  scene.lights.push_back(lamp);
  scene.cameras[0].x_magnification = scene.cameras[0].y_magnification = 0.002F;
  EXPECT_NEAR(static_cast<double>(pixel(test_support::shoot_glb(scene, {}), 4, 4).g),
              through_wall(0.04, 0.5) / kPi, 1e-5);
}

TEST(GltfGlass, EveryStrategyCountsLightThroughAWindowOnce) {
  // The same room with BSDF sampling, light sampling and both. Under a sky of 1 the floor has
  // albedo 1 times the transmittance of the window over the hemisphere, 2 * integral of T(mu) mu
  // dmu.
  const core::SceneDescription scene = under_window(glass(1.5F, 0));
  double expected = 0;
  for (int i = 0; i < 1000; ++i) {
    const double mu = (i + 0.5) / 1000;
    expected += through_wall(schlick(mu), 1) * 2 * mu / 1000;
  }
  for (const core::Strategy strategy :
       {core::Strategy::kMis, core::Strategy::kBsdf, core::Strategy::kLight}) {
    for (const bool doubled : {false, true}) {  // the planted fault: a sky of 1.03 must be detected
      core::View view = test_support::view_of(scene, 8, 8);
      view.environment = test_support::constant_sky(Rgb(doubled ? 1.03F : 1.0F));
      view.settings.max_depth = 1;
      view.settings.estimator.strategy = strategy;
      const Picture picture = test_support::render(view, 2048);
      // The window ends 50 m away: 1/2500 of the hemisphere passes outside it, at grazing angles.
      const double z = std::fabs(static_cast<double>(picture.mean().g) - expected) /
                       (static_cast<double>(picture.standard_error().g) + 1e-4);
      EXPECT_EQ(z > kSigmas, doubled)
          << static_cast<int>(strategy) << ": " << picture.mean().g << " for " << expected;
    }
  }
}

TEST(GltfGlass, ThinWallsReflectWithBothFaces) {
  // A sun and a camera mirrored at the normal: F D G / (4 cos), with F of both faces. Multiple
  // scattering adds less than 1e-3 of it at this roughness.
  const double alpha = 0.25 * 0.25;
  for (const double degrees : {20.0, 60.0}) {
    for (const double c : {1.0, 0.5}) {
      core::MaterialDescription m = glass(1.5F, 0);
      m.roughness = 0.25F;
      m.base_color = Rgb(static_cast<float>(c));
      core::SceneDescription scene = test_support::stage(m);
      scene.lights.push_back(test_support::sun(test_support::towards(degrees), {1, 1, 1}));
      core::View view = test_support::view_of(std::move(scene), 4, 4);
      test_support::look_at(view, test_support::towards(degrees, 180) * 50.0F, {0, 0, 0}, 0.01F);
      view.settings.max_depth = 1;
      const double seen = static_cast<double>(test_support::render(view, 4).mean().g);
      const double cosine = std::cos(degrees * kPi / 180);
      const double tan2 = 1 / (cosine * cosine) - 1;
      const double masking = 1 / std::sqrt(1 + alpha * alpha * tan2);
      const double lobe = masking / (kPi * alpha * alpha * 4 * cosine);
      const double f = schlick(cosine);
      const double both = f + through_wall(f, c) * c * f;
      EXPECT_NEAR(seen, both * lobe, 3e-3 * both * lobe) << degrees << " " << c;
      EXPECT_GT(both, 1.15 * f) << "the planted fault, a wall of one face, would be seen";
    }
  }
}

/// Two faces, 1 m apart: a slab at normal incidence.
core::SceneDescription slab(const core::MaterialDescription& m) {
  core::SceneDescription scene = test_support::stage(m);
  core::PrimitiveDescription top = test_support::patch(0.5F);
  core::PrimitiveDescription bottom = test_support::patch(-0.5F);
  for (core::PrimitiveDescription* p : {&top, &bottom}) {
    for (Vec3& v : p->positions) {
      v = {v.x * 5, v.y * 5, v.z};
    }
  }
  bottom.normals.assign(4, {0, 0, -1});
  bottom.indices = {0, 2, 1, 0, 3, 2};
  scene.meshes[0].primitives = {top, bottom};
  return scene;
}

TEST(GltfGlass, AVolumeAbsorbsByItsAttenuationColorAndDistance) {
  // KHR_materials_volume: the transmittance after d metres is attenuationColor^(d /
  // attenuationDistance).
  core::MaterialDescription m = glass(1, 1);
  m.attenuation_color = {0.5F, 0.25F, static_cast<float>(std::exp(-1.0))};
  m.attenuation_distance = 0.5F;
  Picture picture =
      test_support::shoot_glb(slab(m), {.depth = 8, .sky = test_support::constant_sky({1, 1, 1})});
  const double clear[3] = {0.25, 0.0625, std::exp(-2.0)};
  expect_mean(picture, clear, "matched index");
  // With index 1.5: R + (1 - R)^2 (a + R a^2) / (1 - R^2 a^2), where a is the transmittance of one
  // pass.
  m.ior = 1.5F;
  picture = test_support::shoot_glb(
      slab(m), {.samples = 1024, .depth = 32, .sky = test_support::constant_sky({1, 1, 1})});
  double expected[3];
  for (int c = 0; c < 3; ++c) {
    const double a = clear[c];
    const double r = 0.04;
    expected[c] = r + (1 - r) * (1 - r) * (a + r * a * a) / (1 - r * r * a * a);
  }
  expect_mean(picture, expected, "index 1.5");
}

/// An unlit white wall behind the slab, and a black sky: the transmitted light, with all
/// reflections between the 2 faces.
Rgb passed(const core::MaterialDescription& m) {
  core::SceneDescription scene = slab(m);
  core::MaterialDescription wall;
  wall.unlit = true;
  scene.materials.push_back(wall);
  core::PrimitiveDescription back = test_support::patch(-2, 1);
  for (Vec3& v : back.positions) {
    v = {v.x * 20, v.y * 20, v.z};
  }
  scene.meshes[0].primitives.push_back(back);
  return test_support::shoot_glb(scene, {.samples = 4096, .depth = 32}).mean();
}

TEST(GltfGlass, SpecularFactorAndColorChangeTheReflectanceOfSolids) {
  // KHR_materials_specular: F0 = min(0.04 * colour, 1) * factor at normal incidence, at both faces;
  // transmission is reduced by the largest channel. Reflection of the white sky by the slab: F +
  // T^2 F / (1 - F^2).
  core::MaterialDescription m = glass(1.5F, 1);
  m.specular = 0.5F;
  m.specular_color = {4, 2, 0};
  const double f[3] = {0.08, 0.04, 0};
  const double t = 1 - f[0];
  const Rgb through = passed(m);
  for (int c = 0; c < 3; ++c) {
    // The random walk between the faces: 4.5 standard deviations of 64 x 4096 walks with p near
    // 0.85.
    EXPECT_NEAR(static_cast<double>(through[c]), t * t / (1 - f[c] * f[c]), 4.5 * 0.36 / 512) << c;
  }
  const double plain = 0.96 * 0.96 / (1 - 0.04 * 0.04);
  EXPECT_NEAR(static_cast<double>(passed(glass(1.5F, 1)).g), plain, 4.5 * 0.27 / 512);
  EXPECT_GT(plain - t * t / (1 - f[1] * f[1]), 0.05);  // the fault that the test would detect
}

TEST(GltfGlass, SolidsSupportThinFilms) {
  // KHR_materials_iridescence over a volume: the film's reflectance replaces Fresnel's, from both
  // sides.
  core::MaterialDescription m = glass(1.5F, 1);
  m.iridescence = 1;
  m.iridescence_ior = 1.8F;
  m.iridescence_thickness_max_nm = 300;
  const Rgb film = core::thin_film_fresnel(1, 1.8F, 300, Rgb(0.04F));
  const auto greatest = static_cast<double>(core::max_component(film));
  EXPECT_GT(greatest, 0.08);
  const Rgb through = passed(m);
  for (int c = 0; c < 3; ++c) {
    const auto f = static_cast<double>(film[c]);
    EXPECT_NEAR(static_cast<double>(through[c]), (1 - greatest) * (1 - greatest) / (1 - f * f),
                4.5 * 0.5 / 512)
        << c;
  }
}

TEST(GltfGlass, AbsorbsSunlightInAVolumeOfMatchedIndex) {
  core::MaterialDescription m = glass(1, 1);
  m.attenuation_color = {0.5F, 0.25F, 0.125F};
  m.attenuation_distance = 1;
  core::SceneDescription scene = slab(m);
  scene.materials.push_back(test_support::lambert({1, 1, 1}));
  scene.meshes[0].primitives.push_back(test_support::patch(-2, 1));
  scene.cameras[0].to_world.t = {0, 0, -1};
  scene.lights.push_back(test_support::sun(test_support::towards(60), {1, 1, 1}));
  const Rgb seen = pixel(test_support::shoot_glb(scene, {}), 4, 4);
  for (int c = 0; c < 3; ++c) {
    const double one_way = std::pow(std::pow(0.5, c + 1), 2);  // 2 m through the slab at 60 degrees
    EXPECT_NEAR(static_cast<double>(seen[c]), one_way * 0.5 / kPi, 1e-5) << c;
  }
}

}  // namespace
