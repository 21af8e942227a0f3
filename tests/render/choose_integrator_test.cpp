// Integrator `auto`: its criterion; the choice is a function of scene and job.
#include "core/render/task/choose_integrator.h"

#include <array>

#include <gtest/gtest.h>

#include "core/integrators/registry.h"
#include "core/render/task/settle.h"
#include "core/scene_io/builtin_scenes.h"
#include "core/scene_io/gltf_load.h"
#include "core/settings/sample_sets.h"
#include "tests/support/scenes.h"

namespace {

using core::Rgb;

/// An image in which every pixel has a in half A and b in half B.
core::FilmSnapshot picture_of(float a, float b) {
  core::FilmSnapshot film;
  film.rect = {0, 0, 40, 36};
  film.pixels.resize(film.pixel_count() * 2);
  for (std::size_t i = 0; i < film.pixels.size(); ++i) {
    core::ReplicatePixel& p = film.pixels[i];
    p.count = 1;
    p.mean_r = p.mean_g = p.mean_b = i % 2 == 0 ? a : b;
    p.mean_alpha = 1;
  }
  return film;
}

// The error definition adds 0.05 of an even image's luminance as a floor.
constexpr double kFloor = 0.05 * 0.05;

TEST(PilotErrors, EqualTheHalfVariancesWhereTheImagesAgree) {
  const auto v = core::pilot_errors(
      std::array<core::PilotImage, 2>{{{picture_of(1.1F, 0.9F)}, {picture_of(1.3F, 0.7F)}}});
  // 1.1 0.9 is the most light that both halves found.
  EXPECT_NEAR(v[0], 0.01 / (0.99 + kFloor), 1e-7);
  EXPECT_NEAR(v[1], 0.09 / (0.99 + kFloor), 1e-6);
}

TEST(PilotErrors, CountLightThatAnImageMisses) {
  const auto v = core::pilot_errors(std::array<core::PilotImage, 3>{
      {{picture_of(0.5F, 0.5F)}, {picture_of(1, 1)}, {picture_of(0.25F, 0.25F)}}});
  EXPECT_NEAR(v[0], 0.25 / (1 + kFloor), 1e-6);
  EXPECT_EQ(v[1], 0) << "the brightest image misses no light";
  EXPECT_NEAR(v[2], 0.5625 / (1 + kFloor), 1e-6) << "the most that another image has found";
  const auto none =
      core::pilot_errors(std::array<core::PilotImage, 2>{{{picture_of(0, 0)}, {picture_of(0, 0)}}});
  EXPECT_EQ(none[0] + none[1], 0) << "black images have no error";
}

// A bias of 0.4, of which half the radius leaves 0.1: the brightness is not light that the other
// image has missed.
TEST(PilotErrors, CountTheBiasThatFallsWithTheRadius) {
  const core::PilotImage blurred{picture_of(1.4F, 1.4F), picture_of(1.1F, 1.1F)};
  const core::PilotImage exact{picture_of(1, 1)};
  const auto v = core::pilot_errors(std::array<core::PilotImage, 2>{{exact, blurred}});
  const double scale = 1.4 * 1.4 + 1.4 * 1.4 * kFloor;
  EXPECT_NEAR(v[0], 0, 1e-6);
  EXPECT_NEAR(v[1], 0.16 / scale, 1e-6);
}

// A pilot without noise may be without light: no number of samples brings what it cannot find.
TEST(BestOfPilots, LacksNoLightIfAnotherHasIt) {
  const auto pilots = [](double path_lacks, double bdpt_lacks) {
    return std::array<core::PilotFigures, 2>{
        {{.name = "path", .efficiency = 1000, .lacks = path_lacks},
         {.name = "bdpt", .efficiency = 1, .lacks = bdpt_lacks}}};
  };
  EXPECT_EQ(core::best_of(pilots(0, 0)), 0U);
  EXPECT_EQ(core::best_of(pilots(0.3, 0)), 1U);
  EXPECT_EQ(core::best_of(pilots(0.001, 0)), 0U) << "less than is visible";
  EXPECT_EQ(core::best_of(pilots(0.3, 0.2)), 0U) << "neither finds it";
}

core::View automatic(const char* scene) {
  auto description = core::load_gltf(core::find_builtin_scene(scene)->make_glb(), {}, {});
  core::View view = test_support::view_of(*std::move(description), 48, 27);
  view.settings.integrator = "auto";
  return view;
}

/// A floor below a pane of clear glass, and a small emitter above it: paths from the camera, which
/// is below the pane, find light only by chance.
core::View below_a_pane() {
  core::View view = test_support::view_of(
      test_support::scene_of(
          {test_support::lambert(Rgb(0.6F)), test_support::glass(),
           test_support::emitter(Rgb(12000))},
          {test_support::quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 0),
           test_support::box({0, 1.05F, 0}, {1, 0.05F, 1}, 0, 1),
           test_support::quad({-0.01F, 2, -0.01F}, {0.02F, 0, 0}, {0, 0, 0.02F}, 2)}),
      48, 48);
  test_support::look_at(view, {0, 0.9F, 0.9F}, {0, 0, 0}, 60);
  view.settings.integrator = "auto";
  return view;
}

TEST(ChooseCaustics, TracesPhotonsWhereTheCameraSeesACausticThatPathsMiss) {
  core::View box = automatic("cornell-box");
  core::View pool = automatic("caustic-pool");
  box.settings.integrator = pool.settings.integrator = "path";
  const auto without = core::choose_caustics(box);
  ASSERT_TRUE(without);
  EXPECT_EQ(without->name, "path");
  EXPECT_EQ(without->reason, "'path', since caustics are 0% of the light that the camera sees");
  const auto with = core::choose_caustics(pool);
  ASSERT_TRUE(with);
  EXPECT_EQ(with->name, "path-caustics") << with->reason;
  pool.settings.seed = 5;
  EXPECT_EQ(core::choose_caustics(pool)->reason, with->reason);
}

TEST(ChooseCaustics, SettlesWithTheDefaultsOfTheChoice) {
  for (const auto caustics : {core::CausticsType::kOn, core::CausticsType::kAuto}) {
    core::View view = automatic("caustic-pool");
    view.settings.integrator = "path";
    view.settings.caustics = caustics;
    const auto settled = core::settle_integrator(view, {});
    ASSERT_TRUE(settled);
    EXPECT_TRUE(settled->starts_with("integrator.caustics: '")) << *settled;
    EXPECT_EQ(view.settings.integrator, "path-caustics");
    EXPECT_EQ(view.settings.caustics, core::CausticsType::kOff);
  }
}

TEST(ChooseIntegrator, ChoosesPathForOpenScenesAndBdptBelowAPane) {
  for (const auto& [view, integrator] :
       {std::pair(automatic("cornell-box"), "path"), std::pair(below_a_pane(), "bdpt")}) {
    const auto choice = core::choose_integrator(view, true);
    ASSERT_TRUE(choice);
    ASSERT_EQ(choice->pilots.size(), 2) << "sppm has no valid error";
    const auto& path = choice->pilots[0];
    const auto& bdpt = choice->pilots[1];
    EXPECT_EQ(choice->name, integrator)
        << path.variance << " " << path.work << "; " << bdpt.variance << " " << bdpt.work;
    EXPECT_EQ(bdpt.efficiency > 1.5 * path.efficiency, choice->name == "bdpt");
    EXPECT_NEAR(path.efficiency * path.variance * path.work, 1, 1e-9);
  }
}

/// A dim sky, and a horizontal sun that a mirror at 45 degrees folds down onto a floor: paths from
/// the camera, which looks at the floor from below the mirror, cannot reach the sun.
core::View folded_sun() {
  core::SceneDescription scene = test_support::scene_of(
      {test_support::lambert(Rgb(0.6F)), test_support::mirror()},
      {test_support::quad({-0.9F, 0, 0.5F}, {1.8F, 0, 0}, {0, 0, -1}, 0),
       test_support::quad({-0.95F, 3.15F, 0.5F}, {0, 0, -1}, {1.9F, -1.9F, 0}, 1)});
  scene.lights.push_back(test_support::directional({{0, 0, 1}, {0, 1, 0}, {-1, 0, 0}, {}}));
  core::View view = test_support::view_of(std::move(scene), 48, 48);
  view.environment = test_support::constant_sky(Rgb(0.1F));
  test_support::look_at(view, {0, 1, 0.1F}, {0, 0, 0}, 20);
  view.settings.max_depth = 4;
  view.settings.integrator = "auto";
  return view;
}

TEST(ChooseIntegrator, TakesOneThatFindsTheLightThatParticlesFound) {
  const auto choice = core::choose_integrator(folded_sun(), true);
  ASSERT_TRUE(choice);
  EXPECT_GT(choice->pilots[0].lacks, core::kLackMost);
  EXPECT_LE(choice->pilots[1].lacks, core::kLackMost);
  EXPECT_EQ(choice->name, "bdpt");
  EXPECT_NE(choice->reason.find("that of path lacks"), std::string::npos) << choice->reason;
}

// Light that enters by a gap, caustics under water, which no connection finds, and a scene in which
// photons would only blur.
TEST(ChooseIntegrator, ChoosesPhotonsOnlyWhereTheyWinAndWithoutAnErrorTarget) {
  EXPECT_EQ(core::choose_integrator(automatic("keyhole"), false)->name, "sppm");
  EXPECT_EQ(core::choose_integrator(automatic("caustic-pool"), false)->name, "path-caustics");
  for (const char* scene : {"keyhole", "caustic-pool"}) {
    const auto choice = core::choose_integrator(automatic(scene), true);
    EXPECT_EQ(core::find_integrator(choice->name)->bias, "none") << scene;
  }
  EXPECT_EQ(core::choose_integrator(automatic("cornell-box"), false)->name, "path");
  core::View shares = automatic("keyhole");
  shares.settings.film.shares.emplace_back().layer = "bounce:0-";
  EXPECT_NE(core::choose_integrator(shares, false)->name, "sppm") << "it records no shares";
}

// An orthogonal array has the square of a prime number of points: V counts the samples that were
// rendered, not those that were asked for.
TEST(ChooseIntegrator, CountsRoundedSamples) {
  core::View view = automatic("cornell-box");
  view.settings.sampler = core::SamplerType::kOrthogonalArray;
  const auto choice = core::choose_integrator(view, true);
  ASSERT_TRUE(choice);
  EXPECT_GT(choice->pilots[0].samples, 64);
  EXPECT_EQ(choice->pilots[0].samples, core::rounded_samples(view.settings, 64));
  EXPECT_EQ(choice->pilots[1].samples, core::rounded_samples(view.settings, 16));
}

TEST(ChooseIntegrator, DoesNotDependOnSeedCropOrReplicates) {
  core::View view = automatic("cornell-box");
  const auto choice = core::choose_integrator(view, false);
  view.settings.seed = 77;
  view.settings.replicates = 8;
  view.settings.first_replicate = 4;
  view.settings.film.crop = core::PixelRect{3, 4, 20, 10};
  const auto other = core::choose_integrator(view, false);
  ASSERT_TRUE(choice && other);
  EXPECT_EQ(choice->reason, other->reason);
  view.settings.max_depth = 1;
  EXPECT_NE(core::choose_integrator(view, false)->reason, choice->reason);
}

TEST(ChooseIntegrator, ChoosesAnIntegratorThatSupportsTheScene) {
  core::SceneDescription scene = test_support::cornell();
  scene.materials[0].dispersion = 0.1F;
  core::View view = test_support::view_of(std::move(scene), 40, 40);
  view.settings.integrator = "auto";
  EXPECT_EQ(core::choose_integrator(view, false)->reason, "'path', since the scene has dispersion");
  view = automatic("cornell-box");
  view.settings.fog.emplace();
  EXPECT_EQ(core::choose_integrator(view, false)->name, "path");
}

TEST(ChooseIntegrator, RendersTheImageOfTheChosenIntegrator) {
  core::View view = automatic("cornell-box");
  const auto renderer = core::settled_renderer(view);
  ASSERT_TRUE(renderer);
  EXPECT_EQ((*renderer)->view().settings.integrator, "path");
  const std::string warning = *core::settle_integrator(view, {});
  EXPECT_EQ(view.settings.integrator, "path");
  EXPECT_EQ(view.settings.estimator.splitting, core::SplittingType::kMeasured) << "as for path";
  EXPECT_TRUE(warning.starts_with("integrator.type: 'auto' chose 'path', since")) << warning;
  EXPECT_EQ(*core::settle_integrator(view, {}), "") << "once";
}

}  // namespace
