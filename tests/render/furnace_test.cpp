// Closed spheres and constant environments (truths 1, 2 and 9), for every row of the registries.
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "core/integrators/registry.h"
#include "core/render/picture/meter.h"
#include "core/settings/choices.h"
#include "tests/render/gltf_stage.h"
#include "tests/render/truth.h"
#include "tests/support/statistics.h"

namespace {

using core::Rgb;
using test_support::expect_truth;

core::View inside_sphere(const core::MaterialDescription& material, int stacks = 8) {
  core::View view = test_support::view_of(
      test_support::scene_of({material}, {test_support::sphere({0, 0, 0}, 1, stacks, true, 0)}), 24,
      24);
  test_support::look_at(view, {0.1F, 0.2F, 0.3F}, {1, 0.1F, -0.4F}, 70);
  return view;
}

core::MaterialDescription grey_lamp() {
  auto material = test_support::lambert(Rgb(0.5F));
  material.emissive = Rgb(0.5F);
  return material;
}

// Truth 1: L = L_e / (1 - rho) = 1.
TEST(ClosedSphere, RadianceIsOneForEveryRegisteredOption) {
  core::View view = inside_sphere(grey_lamp());
  view.settings.max_depth = 32;
  for (const auto& v : test_support::variants()) {
    test_support::apply(v, view);
    const bool is_noisy = v.name == "light/uniform" || !v.estimator.expected_values;
    expect_truth(test_support::render(view, is_noisy ? 160 : 64), 1, 4e-3, v.name);
  }
}

TEST(ClosedSphere, RadianceIsOneMinusAPowerOfTheAlbedoAtLimitedDepth) {
  core::View view = inside_sphere(grey_lamp());
  view.settings.estimator.roulette = core::RouletteType::kNone;
  for (const int depth : {0, 1, 2, 3, 7}) {
    view.settings.max_depth = depth;
    expect_truth(test_support::render(view, 128), 1 - std::pow(0.5, depth + 1), 1e-3,
                 "depth " + std::to_string(depth));
  }
}

TEST(ClosedSphere, ThousandsOfEmittersDoNotChangeTheRadiance) {
  core::View view = inside_sphere(grey_lamp(), 40);
  view.settings.max_depth = 32;
  for (const auto& lights : core::light_samplers()) {
    if (lights.value == core::LightSamplerType::kMeasured) {
      continue;  // tree or ris: choose_light_sampler_test.cpp
    }
    view.settings.light_sampler = lights.value;
    expect_truth(test_support::render(view, 320), 1, 1e-3, std::string(lights.name));
  }
}

core::MaterialDescription solid(float transmission, float ior) {
  core::MaterialDescription m = test_support::lambert(Rgb(1));
  m.ior = ior;
  m.transmission = transmission;
  m.diffuse_transmission = 1 - transmission;
  m.thickness = 1;
  return m;
}

// A ball with holes, of glass or of wax, fills half of the view of each point of the wall that the
// camera sees. If holes alone, or the surface alone, changed radiance, it would appear up to 1.9
// times as bright.
TEST(ClosedSphere, SolidsWithHolesDoNotChangeTheRadiance) {
  for (const float transmission : {1.0F, 0.0F}) {
    core::MaterialDescription ball = solid(transmission, 2.4F);
    ball.roughness = 1 - transmission;
    ball.alpha_mode = core::AlphaMode::kBlend;
    ball.base_alpha = 0.5F;
    core::View view = test_support::view_of(
        test_support::scene_of({grey_lamp(), ball},
                               {test_support::sphere({0, 0, 0}, 1, 16, true, 0),
                                test_support::sphere({0, 0, 0}, 0.7F, 16, false, 1)}),
        12, 12);
    test_support::look_at(view, {0.84F, 0, 0}, {1, 0.05F, 0.02F}, 40);
    view.settings.max_depth = 64;
    for (const core::IntegratorEntry& row : core::integrators()) {
      if (row.name != "direct" && row.name != core::kAutomaticIntegrator) {
        view.settings.integrator = std::string(row.name);
        // 6 % for the blur of biased rows, as in solids_test.cpp.
        expect_truth(test_support::render(view, row.name == "light-trace" ? 2048 : 64), 1, 6e-2,
                     std::string(row.name) + " transmission " + std::to_string(transmission),
                     row.bias == "none" ? 0 : 0.06);
      }
    }
  }
}

struct Lossless {
  const char* name;
  core::MaterialDescription material;
  double cap;
};

std::vector<Lossless> lossless() {
  std::vector<Lossless> all;
  all.push_back({"lambert", test_support::lambert(Rgb(1)), 1e-3});
  for (const float roughness : {0.0F, 0.25F, 0.5F, 1.0F}) {
    core::MaterialDescription m;
    m.roughness = roughness;
    m.metallic = 0;
    all.push_back({"dielectric", m, 5e-3});  // tables of energy compensation: truth 3
    m.metallic = 1;
    all.push_back({"metal", m, 5e-3});
    m.metallic = 0;
    m.transmission = 1;
    m.double_sided = true;
    all.push_back({"thin glass", m, roughness > 0 ? 1e-2 : 1e-3});
    m.thickness = 1;
    all.push_back({"solid glass", m, roughness > 0 ? 2e-2 : 1e-3});
    m.alpha_mode = core::AlphaMode::kBlend;
    m.base_alpha = 0.5F;
    all.push_back({"solid glass with holes", m, roughness > 0 ? 2e-2 : 1e-3});
    m.alpha_mode = core::AlphaMode::kOpaque;
    m.anisotropy = 1;
    all.push_back({"brushed solid glass", m, 2e-2});
    m.anisotropy = 0;
    m.transmission = 0.5F;
    m.diffuse_transmission = 0.5F;
    all.push_back({"milky glass", m, roughness > 0 ? 1e-2 : 5e-3});
    m.transmission = 0;
    m.diffuse_transmission = 1;
    all.push_back({"wax", m, 5e-3});
    m.alpha_mode = core::AlphaMode::kBlend;
    all.push_back({"wax with holes", m, 5e-3});
  }
  return all;
}

// Truth 2: in a white furnace a lossless ball is invisible.
TEST(WhiteFurnace, LosslessBallsAreInvisible) {
  for (const Lossless& l : lossless()) {
    core::View view = test_support::view_of(
        test_support::scene_of({l.material}, {test_support::sphere({0, 0, 0}, 1, 16, false, 0)}),
        15, 15);
    test_support::look_at(view, {0, 0, 3}, {0, 0, 0}, 30);  // the ball fills the image
    view.environment = test_support::constant_sky({1, 1, 1});
    view.settings.max_depth = 128;
    const std::string what =
        std::string(l.name) + " roughness " + std::to_string(l.material.roughness);
    // The scatter of 32 images of 16 samples gives the standard error of each pixel. At the
    // silhouette, at grazing angles, it is ten times that at the centre.
    std::vector<test_support::Moments> pixels(15 * 15);
    test_support::Moments all;
    for (view.settings.seed = 1; view.settings.seed <= 32; ++view.settings.seed) {
      const auto picture = test_support::render(view, 16);
      EXPECT_EQ(picture.progress.rejected_samples, 0U) << what;
      all.add(static_cast<double>(picture.mean().g));
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        pixels[i].add(static_cast<double>(core::pixel_value(picture.snapshot, i).mean.g));
      }
    }
    EXPECT_NEAR(all.mean, 1, l.cap + 4 * all.standard_error()) << what;
    EXPECT_LT(all.standard_error(), 5e-3) << what;
    // No pixel exceeds 1 by more than noise and the tolerance of the tables. 29 x 225 pixels,
    // Student's t with 31 degrees of freedom beyond 7: a false alarm in 0.03% of such tests.
    for (const test_support::Moments& pixel : pixels) {
      EXPECT_LT(pixel.mean, 1 + l.cap + 7 * pixel.standard_error() + 1e-5) << what;
    }
  }
}

/// Returns the mean of a ball that fills the image, in a white furnace.
test_support::Picture ball_in_furnace(core::SceneDescription scene) {
  core::View view = test_support::view_of(std::move(scene), 12, 12);
  test_support::look_at(view, {0, 0, 3}, {0, 0, 0}, 30);
  view.environment = test_support::constant_sky({1, 1, 1});
  view.settings.max_depth = 128;
  return test_support::render(view, 512);
}

// Light may come in by one texel, or by one part of the surface, and go out by another.
TEST(WhiteFurnace, HoldsWhereTransmissionVaries) {
  for (const float alpha : {1.0F, 0.5F}) {
    for (const int other : {0, 128, 255}) {
      core::MaterialDescription m = solid(1, 1.5F);
      m.diffuse_transmission = 1;
      m.alpha_mode = core::AlphaMode::kBlend;
      m.base_alpha = alpha;
      core::PrimitiveDescription ball = test_support::sphere({0, 0, 0}, 1, 16, false, 0);
      for (const core::Vec3 p : ball.positions) {
        ball.uv[0].push_back({0.5F + 0.5F * p.x, 0.5F});
      }
      core::SceneDescription scene = test_support::scene_of({m}, {std::move(ball)});
      scene.materials[0].transmission_texture.image =
          test_support::add_image(scene, 2, 1, 3, {0, 0, 0, other, other, other});
      scene.materials[0].transmission_texture.nearest = true;
      const std::string what = "texels 0 and " + std::to_string(other);
      expect_truth(ball_in_furnace(std::move(scene)), 1, 1e-2, what, 5e-3);
    }
    std::vector<core::MaterialDescription> parts = {solid(0, 1.5F), solid(1, 1.5F)};
    for (core::MaterialDescription& m : parts) {
      m.alpha_mode = core::AlphaMode::kBlend;
      m.base_alpha = alpha;
    }
    for (const std::size_t share : {1U, 2U}) {  // of three
      core::PrimitiveDescription wax = test_support::sphere({0, 0, 0}, 1, 16, false, 0);
      core::PrimitiveDescription glass = wax;
      glass.material = 1;
      const auto cut = static_cast<std::ptrdiff_t>(wax.indices.size() / 9 * 3 * share);
      glass.indices.erase(glass.indices.begin(), glass.indices.begin() + cut);
      wax.indices.erase(wax.indices.begin() + cut, wax.indices.end());
      expect_truth(ball_in_furnace(test_support::scene_of(parts, {wax, glass})), 1, 1e-2,
                   std::to_string(share) + " thirds of wax", 5e-3);
    }
  }
}

TEST(WhiteFurnace, AMeterBesideASolidWithHolesReadsTheSky) {
  for (const float transmission : {1.0F, 0.0F}) {
    core::MaterialDescription m = solid(transmission, 1.5F);
    m.alpha_mode = core::AlphaMode::kBlend;
    m.base_alpha = 0.5F;
    core::View view = test_support::view_of(
        test_support::scene_of({m}, {test_support::sphere({0, 0, 0}, 1, 16, false, 0)}), 4, 4);
    view.environment = test_support::constant_sky({1, 1, 1});
    view.settings.max_depth = 128;
    view.settings.meter.points = {{{0, 0, 1.05}, {0, 0, -1}}};
    const core::Meter meter({view.scene->data(), view.environment.get(), view.settings});
    core::MeterChunk chunk;
    ASSERT_TRUE(meter.render(0, chunk, 16384, {}));
    const auto readings = core::meter_readings(core::meter_points(view.settings.meter), {chunk});
    EXPECT_NEAR(readings.at(0).illuminance / std::numbers::pi, 1, 0.02) << transmission;
  }
}

TEST(WhiteFurnace, HoldsForEveryOptionOfTheRegistries) {
  core::MaterialDescription m;
  m.metallic = 0;
  m.roughness = 0.7F;
  core::View view = test_support::view_of(
      test_support::scene_of({test_support::lambert(Rgb(1)), m},
                             {test_support::sphere({0, 0, 0}, 1, 16, false, 1),
                              test_support::quad({-9, -1, 9}, {18, 0, 0}, {0, 0, -18}, 0)}),
      20, 20);
  test_support::look_at(view, {0, 0, 3}, {0, 0, 0}, 30);
  view.environment = test_support::constant_sky({1, 1, 1});
  view.settings.max_depth = 128;
  for (const auto& v : test_support::variants()) {
    test_support::apply(v, view);
    const auto picture = test_support::render(view, 128);
    EXPECT_NEAR(picture.mean().g, 1, 5e-3 + 4 * static_cast<double>(picture.standard_error().g))
        << v.name;
    EXPECT_LT(picture.standard_error().g, 8e-3F) << v.name;
  }
}

// Truth 9: radiance in glass is n^2 that of air.
TEST(GlassSphere, RadianceOfTheSkyInGlassIsNSquaredTimesThatInAir) {
  core::View view = test_support::view_of(
      test_support::scene_of({test_support::glass()},
                             {test_support::sphere({0, 0, 0}, 1, 32, false, 0)}),
      24, 24);
  test_support::look_at(view, {0, 0, 0}, {0, 0, -1}, 60);
  view.environment = test_support::constant_sky({1, 1, 1});
  view.settings.max_depth = 256;
  expect_truth(test_support::render(view, 256), 2.25, 1e-3, "glass");
}

}  // namespace
