// Groups of paths that reuse light samples, over pixels and passes, are functions of the job,
// tested by the bits of films.
#include <utility>

#include <gtest/gtest.h>

#include "core/integrators/registry.h"
#include "core/render/task/render_task.h"
#include "core/render/task/settle.h"
#include "core/settings/sample_sets.h"
#include "tests/support/scenes.h"

namespace {

using core::Film;
using core::RenderTask;

class NullSink : public core::RenderSink {
 public:
  void on_tile(int /*tile*/, std::uint32_t /*revision*/) override {}
  void on_pass(const core::ConvergencePoint& /*point*/) override {}
  void on_finished(core::StopReason /*why*/) override {}
};

/// Squares of block x block pixels and `history` passes reuse samples.
core::View shared_view(core::AdaptiveType adaptive, int block, int history) {
  core::View view = test_support::view_of(test_support::build(test_support::cornell()), 41, 37);
  test_support::look_at(view, {0.5F, 0.5F, 2.2F}, {0.5F, 0.5F, 0}, 35);
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

core::TaskOptions options_of(double slice_seconds, int samples = 60) {
  core::TaskOptions options;
  options.stop.samples_per_pixel = samples;
  options.slice_target_seconds = slice_seconds;
  return options;
}

std::shared_ptr<Film> film_of(const core::View& view) { return make_film(view.settings); }

std::shared_ptr<const core::Renderer> renderer_of(const core::View& view) {
  auto renderer = test_support::settled_renderer(view);
  EXPECT_TRUE(renderer);
  return *renderer;
}

std::string digest_of(const core::View& view, double slice_seconds, int threads) {
  const auto film = film_of(view);
  NullSink sink;
  RenderTask task(renderer_of(view), film, options_of(slice_seconds), sink);
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

/// Resumes the film in another process: only its tiles remain of the first.
std::shared_ptr<Film> reloaded(const core::View& view, const Film& film) {
  const auto again = film_of(view);
  for (int t = 0; t < film.tile_count(); ++t) {
    again->restore(t, film.tile(t), film.tile_revision(t));
  }
  return again;
}

// The content of a checkpoint suffices: groups keep no state from before, and no slice ends within
// a window.
TEST(SharedLightBits, AreIndependentOfKillAndResume) {
  for (const auto& [block, history] : {std::pair{5, 1}, std::pair{3, 4}}) {
    const core::View view = shared_view(core::AdaptiveType::kNone, block, history);
    const std::string calm = digest_of(view, 100, 1);
    for (int taken = 3; taken < 16; taken += 5) {
      const auto film = film_of(view);
      {
        NullSink sink;
        RenderTask task(renderer_of(view), film, options_of(1e-3), sink);
        for (int i = 0; i < taken; ++i) {
          if (const auto slice = task.take()) {
            task.run(*slice);
          }
        }
      }
      for (int t = 0; t < film->tile_count(); ++t) {
        EXPECT_EQ(film->tile_samples(t) % core::shared_window(view.settings), 0);
      }
      const auto again = reloaded(view, *film);
      NullSink sink;
      RenderTask task(renderer_of(view), again, options_of(0.02), sink);
      core::run_to_end(task, 2);
      EXPECT_EQ(again->digest(), calm) << taken;
    }
  }
}

TEST(SharedLightBits, AreIndependentOfExtension) {
  const core::View view = shared_view(core::AdaptiveType::kNone, 3, 4);
  const std::string at_once = digest_of(view, 100, 1);
  const auto film = film_of(view);
  NullSink sink;
  RenderTask first(renderer_of(view), film, options_of(1e-3, 41), sink);
  core::run_to_end(first, 2);
  EXPECT_EQ(film->tile_samples(0), 48) << "whole windows";
  const auto again = reloaded(view, *film);
  RenderTask second(renderer_of(view), again, options_of(1e-3), sink);
  core::run_to_end(second, 2);
  EXPECT_EQ(again->digest(), at_once);
}

}  // namespace
