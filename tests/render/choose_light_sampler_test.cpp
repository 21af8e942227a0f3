// Light sampler and splitting `measured`: the pilots' choice is that of images.
#include <stop_token>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "core/render/task/choose_integrator.h"
#include "core/render/task/settle.h"
#include "core/scene_io/builtin_scenes.h"
#include "core/scene_io/gltf_load.h"
#include "tests/support/scenes.h"

namespace {

using core::LightSamplerType;

core::View view_of(const char* scene, LightSamplerType type) {
  auto description = core::load_gltf(core::find_builtin_scene(scene)->make_glb(), {}, {});
  core::View view = test_support::view_of(*std::move(description), 64, 36);
  view.settings.light_sampler = type;
  return view;
}

// 1 / (V T) in images of 256 x 256 pixels, 32 samples: ris 1.33 times tree in veach-mis, .81 times
// in cornell-box.
TEST(ChooseLightSampler, TakesRisWhereGlossySurfacesReflectSeveralLights) {
  for (const auto& [scene, type] : {std::pair("cornell-box", LightSamplerType::kTree),
                                    std::pair("veach-mis", LightSamplerType::kRis)}) {
    core::View view = view_of(scene, LightSamplerType::kMeasured);
    const auto settled = core::settle(view, {});
    ASSERT_TRUE(settled);
    EXPECT_EQ(*settled, "");
    EXPECT_EQ(view.settings.light_sampler, type) << scene;
    // A job that names the choice gives the same image.
    core::View named = view_of(scene, type);
    named.settings.light_candidates = view.settings.light_candidates;
    EXPECT_EQ(test_support::render(std::move(named), 4).film->digest(),
              test_support::render(view_of(scene, LightSamplerType::kMeasured), 4).film->digest());
  }
}

TEST(ChooseLightSampler, DoublesCandidatesWhileThatPays) {
  const auto choice = core::choose_light_sampler(view_of("veach-mis", LightSamplerType::kTree));
  ASSERT_TRUE(choice);
  EXPECT_GE(choice->candidates, 4);
  const auto& pilots = choice->pilots;
  ASSERT_GE(pilots.size(), 3U);
  for (std::size_t k = 1; k < pilots.size(); ++k) {
    EXPECT_LT(pilots[k].error, pilots[k - 1].error);
    const bool is_taken = 1 << k <= choice->candidates;
    EXPECT_EQ(is_taken, pilots[k].efficiency > pilots[k - 1].efficiency);
    // Shadow rays of ris are as many as those of tree, but for points that no candidate reaches.
    EXPECT_NEAR(pilots[k].work / pilots[0].work, 1 + 0.2 * ((1 << k) - 1), 0.1);
  }
}

// All parts of an image, and all of its seeds, agree.
TEST(ChooseLightSampler, DependsOnNoPart) {
  const core::View whole = view_of("veach-mis", LightSamplerType::kTree);
  core::View part = whole;
  part.settings.film.crop = core::PixelRect{3, 5, 8, 8};
  part.settings.seed = 5;
  part.settings.first_replicate = 2;
  const auto one = core::choose_light_sampler(whole);
  const auto other = core::choose_light_sampler(part);
  EXPECT_EQ(one->candidates, other->candidates);
  EXPECT_EQ(one->pilots.back().efficiency, other->pilots.back().efficiency);
}

TEST(ChooseLightSampler, StaysWithTheTreeWhereRisDoesNotFit) {
  core::View view = view_of("veach-mis", LightSamplerType::kMeasured);
  view.settings.estimator.mis = core::MisType::kOptimal;
  const auto settled = core::settle(view, {});
  ASSERT_TRUE(settled) << settled.error().message;
  EXPECT_EQ(view.settings.light_sampler, LightSamplerType::kTree);
}

TEST(ChooseLightSampler, RendersNoPilotsOfDistantLights) {
  const auto choice = core::choose_light_sampler(view_of("furnace", LightSamplerType::kTree));
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->type, LightSamplerType::kTree);
  EXPECT_TRUE(choice->pilots.empty());
}

core::View measured_view(const char* scene) {
  core::View view = view_of(scene, LightSamplerType::kTree);
  view.measured.emplace();
  return view;
}

// Light on glossy plates is noise of the continuations; a furnace has no noise.
TEST(ChooseSplitCount, SplitsWhereContinuationsAreTheNoise) {
  EXPECT_GE(*core::choose_split_count(measured_view("veach-mis")), 2);
  EXPECT_EQ(*core::choose_split_count(measured_view("furnace")), 1);
}

// Cameras with an open aperture: the noise is that of the camera's rays, which splitting leaves.
TEST(ChooseSplitCount, SplitsLessWhereTheLensIsTheNoise) {
  core::View view = measured_view("veach-mis");
  view.camera.aperture_radius_m = 2.0F;
  view.camera.focus_distance_m = 1.0F;
  EXPECT_LT(*core::choose_split_count(view), *core::choose_split_count(measured_view("veach-mis")));
}

// All parts of an image agree, also with a job that was settled before.
TEST(ChooseSplitCount, DependsOnNeitherPartsNorTheLightSampler) {
  const core::View whole = measured_view("still-life");
  core::View part = whole;
  part.settings.film.crop = core::PixelRect{3, 5, 8, 8};
  part.settings.seed = 5;
  part.settings.first_replicate = 2;
  part.settings.light_sampler = LightSamplerType::kRis;
  EXPECT_EQ(*core::choose_split_count(whole), *core::choose_split_count(part));
}

// Previews, of which pilots would be the larger part.
TEST(Settle, RendersNoPilotsOfQuickViews) {
  core::View view = view_of("veach-mis", LightSamplerType::kMeasured);
  view.settings.estimator.splitting = core::SplittingType::kMeasured;
  view.is_quick = true;
  ASSERT_TRUE(core::settle(view, {}));
  EXPECT_EQ(view.settings.light_sampler, LightSamplerType::kTree);
  EXPECT_EQ(view.measured->split_count, 2);
}

TEST(ChooseLightSampler, CanBeStopped) {
  std::stop_source stop;
  stop.request_stop();
  core::View view = view_of("veach-mis", LightSamplerType::kMeasured);
  const auto settled = core::settle(view, {}, stop.get_token());
  ASSERT_FALSE(settled);
  EXPECT_EQ(settled.error().code, core::ErrorCode::kCancelled);
}

}  // namespace
