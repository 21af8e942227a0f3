// Groups of paths that reuse light samples, over pixels and passes, are functions of the job,
// tested by the bits of films.
#include <utility>

#include <gtest/gtest.h>

#include "core/integrators/registry.h"
#include "core/render/task/render_task.h"
#include "core/render/task/settle.h"
#include "core/settings/sample_sets.h"
#include "tests/support/scenes.h"
#include "tests/support/tasks.h"

namespace {

using core::RenderTask;
using test_support::renderer_of;
using test_support::samples;

/// Squares of block x block pixels and `history` passes reuse samples.
core::View shared_view(core::AdaptiveType adaptive, int block, int history) {
  core::View view = test_support::cornell_view(41, 37, 35);
  view.settings.film.filter = {core::FilterType::kMitchell, 2};
  view.settings.film.albedo = view.settings.film.normal = view.settings.film.depth = true;
  view.settings.light_sampler = core::LightSamplerType::kRestir;
  view.settings.light_block = block;
  view.settings.light_history = history;
  view.settings.replicates = 4;
  view.settings.adaptive.type = adaptive;
  view.settings.adaptive.min_samples = 20;
  return view;
}

std::string digest_of(const core::View& view, double slice_seconds, int threads) {
  const auto film = make_film(view.settings);
  core::NullSink sink;
  RenderTask task(renderer_of(view), film, samples(60, slice_seconds), sink);
  core::run_to_end(task, threads);
  return film->digest();
}

// A plan gives pixels different counts, in steps of all replicates of a half. 60 samples are whole
// windows of 20 and of 12.
TEST(SharedLightBits, AreIndependentOfThreadsAndSlices) {
  for (const core::AdaptiveType adaptive :
       {core::AdaptiveType::kNone, core::AdaptiveType::kPilot}) {
    for (const auto& [block, history] : {std::pair{5, 1}, std::pair{3, 5}, std::pair{1, 3}}) {
      SCOPED_TRACE(history);
      const core::View view = shared_view(adaptive, block, history);
      const std::string one = digest_of(view, 100, 1);
      EXPECT_EQ(digest_of(view, 1e-9, 2), one);
      EXPECT_EQ(digest_of(view, 1e-3, 7), one);
      core::View other = view;
      other.settings.light_block = block == 5 ? 4 : 2;
      EXPECT_NE(digest_of(other, 100, 2), one) << "spatial reuse must have an effect";
      other = view;
      other.settings.light_history = history == 1 ? 2 : 1;
      EXPECT_NE(digest_of(other, 100, 2), one) << "temporal reuse must have an effect";
    }
  }
}

// The content of a checkpoint suffices: groups keep no state from before, and no slice ends within
// a window.
TEST(SharedLightBits, AreIndependentOfKillAndResume) {
  for (const auto& [block, history] : {std::pair{5, 1}, std::pair{3, 4}}) {
    const core::View view = shared_view(core::AdaptiveType::kNone, block, history);
    const std::string calm = digest_of(view, 100, 1);
    for (int taken = 3; taken < 16; taken += 5) {
      const auto film = make_film(view.settings);
      {
        core::NullSink sink;
        RenderTask task(renderer_of(view), film, samples(60, 1e-3), sink);
        test_support::run_slices(task, taken);
      }
      for (int t = 0; t < film->tile_count(); ++t) {
        EXPECT_EQ(film->tile_samples(t) % core::shared_window(view.settings), 0);
      }
      const auto again = test_support::restored(*film);
      core::NullSink sink;
      RenderTask task(renderer_of(view), again, samples(60), sink);
      core::run_to_end(task, 2);
      EXPECT_EQ(again->digest(), calm) << taken;
    }
  }
}

TEST(SharedLightBits, AreIndependentOfExtension) {
  const core::View view = shared_view(core::AdaptiveType::kNone, 3, 4);
  const std::string at_once = digest_of(view, 100, 1);
  const auto film = make_film(view.settings);
  core::NullSink sink;
  RenderTask first(renderer_of(view), film, samples(41, 1e-3), sink);
  core::run_to_end(first, 2);
  EXPECT_EQ(film->tile_samples(0), 48) << "whole windows";
  const auto again = test_support::restored(*film);
  RenderTask second(renderer_of(view), again, samples(60, 1e-3), sink);
  core::run_to_end(second, 2);
  EXPECT_EQ(again->digest(), at_once);
}

}  // namespace
