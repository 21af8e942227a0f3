// Bidirectional path tracing in scattering media (truths 11 and 19) gives the same images as path:
// milk behind boundaries with and without refraction, and fog.
#include "tests/render/agreement.h"
#include "tests/render/agreement_scenes.h"
#include "tests/render/truth.h"
#include "tests/support/milk.h"

namespace {

using core::Rgb;
using test_support::agrees;
using test_support::Blocks;
using test_support::blocks_of;
using test_support::compare;
using test_support::expect_agreement;
using test_support::expect_truth;
using test_support::fog_in_box;
using test_support::milk;
using test_support::plus;

constexpr int kSide = 16;

core::View of(core::SceneDescription scene) {
  core::View view = test_support::view_of(std::move(scene), kSide, kSide);
  test_support::look_at(view, {0.5F, 0.5F, 2.2F}, {0.5F, 0.5F, 0}, 40);
  view.settings.max_depth = 3;
  view.settings.estimator.roulette = core::RouletteType::kNone;
  return view;
}

/// The Cornell box with a ball of this medium in front of its blocks.
core::View ball_in_box(core::MaterialDescription medium) {
  core::SceneDescription scene = test_support::cornell();
  const auto material = static_cast<int>(scene.materials.size());
  scene.materials.push_back(std::move(medium));
  scene.meshes[0].primitives.push_back(
      test_support::sphere({0.5F, 0.6F, 0.6F}, 0.3F, 10, false, material));
  return of(std::move(scene));
}

/// The same ball on a floor under a sky that is brighter on one side: behind a refracting boundary
/// paths find skies, but not small emitters.
core::View ball_under_sky(core::MaterialDescription medium) {
  core::View view =
      of(test_support::scene_of({test_support::lambert({0.7F, 0.5F, 0.3F}), std::move(medium)},
                                {test_support::quad({-2, 0, 2}, {5, 0, 0}, {0, 0, -5}, 0),
                                 test_support::sphere({0.5F, 0.5F, 0.5F}, 0.5F, 10, false, 1)}));
  view.environment = test_support::sky_map(
      16, 8, [](int x, int /*y*/) { return Rgb(0.5F + 0.1F * static_cast<float>(x % 8)); });
  return view;
}

/// Extinction of 0.4, 2 and 8 over the ball's radius.
core::MaterialDescription wax() {
  core::MaterialDescription m = milk(0.95F, 0.15F, 0.3F);
  m.attenuation_color = {std::exp(-0.2F), std::exp(-1.0F), std::exp(-4.0F)};
  return m;
}

core::MaterialDescription with_holes(core::MaterialDescription m) {
  m.alpha_mode = core::AlphaMode::kBlend;
  m.base_alpha = 0.5F;
  return m;
}

struct Case {
  const char* name;
  core::View view;
  int samples;  ///< of each integrator
};
std::vector<Case> cases() {
  // Without the point light: light that scatters close by has infinite variance, which shows where
  // the fog is dense.
  core::View coloured = fog_in_box(kSide, {0.2F, 1, 3});
  coloured.scene = test_support::box(kSide).scene;
  return {
      {"milk that refracts", ball_under_sky(milk(0.9F, 0.2F, 0.3F, 1.3F)), 12},
      {"milk with holes", ball_under_sky(with_holes(milk(0.9F, 0.2F, 0.3F))), 12},
      {"milk without a boundary whose channels have their own extinction", ball_in_box(wax()), 48},
      {"fog with a lamp in it", fog_in_box(kSide, Rgb(1)), 30},
      {"coloured fog", coloured, 80}};
}

constexpr int kComparisons = 5;

TEST(BdptMedia, ImagesAreThoseOfPath) {
  for (const Case& c : cases()) {
    const Blocks reference = blocks_of(c.view, 1000, 2 * c.samples);
    core::View view = c.view;
    view.settings.integrator = "bdpt";
    const Blocks seen = blocks_of(view, 1, c.samples);
    expect_agreement(compare(seen, reference), kComparisons, c.name);
    EXPECT_FALSE(agrees(compare(plus(seen, 0.03, seen), reference), kComparisons))
        << c.name << " with 3% more light";
  }
}

// The whole image hardly changes: the emitter darkens and the fog brightens.
TEST(BdptMedia, DetectsFivePercentMoreScattering) {
  const Case c = {"", fog_in_box(kSide, Rgb(1)), 64};
  const Blocks reference = blocks_of(c.view, 1000, 2 * c.samples);
  core::View view = fog_in_box(kSide, Rgb(1.05F));
  view.settings.integrator = "bdpt";
  EXPECT_FALSE(agrees(compare(blocks_of(view, 1, c.samples), reference), kComparisons));
}

// Truth 11.
TEST(BdptMedia, LosslessMilkIsInvisible) {
  core::MaterialDescription wax = milk(1, 0.5F, 0.4F, 1.5F);
  wax.transmission = 0;
  wax.diffuse_transmission = 1;
  for (const core::MaterialDescription& m :
       {milk(1, 0.5F, 0.4F), milk(1, 0.5F, 0.4F, 1.3F), with_holes(milk(1, 0.5F, 0.4F)),
        with_holes(milk(1, 0.5F, 0.4F, 1.3F)), with_holes(wax)}) {
    const float ior = m.ior;
    core::View view = test_support::view_of(
        test_support::scene_of({m}, {test_support::sphere({0, 0, 0}, 1, 16, false, 0)}), 12, 12);
    test_support::look_at(view, {0, 0, 3}, {0, 0, 0}, 30);
    view.environment = test_support::constant_sky({1, 1, 1});
    view.settings.max_depth = 64;
    view.settings.integrator = "bdpt";
    expect_truth(test_support::render(view, 512), 1, 8e-3,
                 "ior " + std::to_string(ior) + ", coverage " + std::to_string(m.base_alpha));
    view.scene = test_support::build(test_support::scene_of(
        {milk(0.9F, 0.5F, 0.4F, ior)}, {test_support::sphere({0, 0, 0}, 1, 16, false, 0)}));
    EXPECT_LT(test_support::render(view, 16).mean().g, 0.95F) << "the furnace can fail";
  }
}

// There is none in solids, whatever way leads into them.
TEST(BdptMedia, LosslessFogAroundGlassWithHolesIsInvisible) {
  core::View view = test_support::view_of(
      test_support::scene_of({with_holes(test_support::glass(1.3F))},
                             {test_support::sphere({0, 0, 0}, 1, 16, false, 0)}),
      12, 12);
  test_support::look_at(view, {0, 0, 3}, {0, 0, 0}, 30);
  view.environment = test_support::constant_sky({1, 1, 1});
  view.settings.max_depth = 64;
  view.settings.fog.emplace().scattering = Rgb(1);
  for (const char* integrator : {"path", "bdpt"}) {
    view.settings.integrator = integrator;
    expect_truth(test_support::render(view, 512), 1, 1e-2, integrator);
  }
}

TEST(BdptMedia, BitsDoNotDependOnThreads) {
  core::View view = fog_in_box(kSide, {0.2F, 1, 3});
  view.settings.integrator = "bdpt";
  EXPECT_EQ(test_support::render(view, 4, 1).film->digest(),
            test_support::render(view, 4, 2).film->digest());
}

}  // namespace
