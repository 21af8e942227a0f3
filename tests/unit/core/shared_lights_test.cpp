// Groups of pixels that share light samples are functions of the job: the bits of films.
#include <gtest/gtest.h>

#include "core/render/registry.h"
#include "core/render/render_task.h"
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

core::View shared_view(core::AdaptiveType adaptive) {
  core::View view = test_support::view_of(test_support::build(test_support::cornell()), 70, 45);
  test_support::look_at(view, {0.5F, 0.5F, 2.2F}, {0.5F, 0.5F, 0}, 35);
  view.settings.film.filter = {core::FilterType::kMitchell, 2};
  view.settings.film.albedo = view.settings.film.normal = view.settings.film.depth = true;
  view.settings.light_sampler = core::LightSamplerType::kRestir;
  view.settings.light_block = 5;
  view.settings.replicates = 4;
  view.settings.adaptive.type = adaptive;
  return view;
}

core::TaskOptions options_of(double slice_seconds) {
  core::TaskOptions options;
  options.stop.samples_per_pixel = 96;
  options.slice_target_seconds = slice_seconds;
  return options;
}

std::shared_ptr<Film> film_of(const core::View& view) {
  return std::make_shared<Film>(view.settings, core::pixel_errors(view.settings));
}

std::shared_ptr<const core::Renderer> renderer_of(const core::View& view) {
  auto renderer = core::Renderer::create(view);
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

// A plan gives pixels different counts, in steps of all replicates of a half.
TEST(SharedLightBits, AreTheSameForOneTwoAndSevenThreadsAndAnySlices) {
  for (const core::AdaptiveType adaptive : {core::AdaptiveType::kNone, core::AdaptiveType::kPilot}) {
    const core::View view = shared_view(adaptive);
    const std::string one = digest_of(view, 100, 1);
    EXPECT_EQ(digest_of(view, 1e-9, 2), one);
    EXPECT_EQ(digest_of(view, 1e-3, 7), one);
    core::View other = view;
    other.settings.light_block = 4;
    EXPECT_NE(digest_of(other, 100, 2), one) << "squares must matter";
  }
}

// What a checkpoint keeps is enough: groups remember nothing of what came before.
TEST(SharedLightBits, AreTheSameAfterKillAndResume) {
  const core::View view = shared_view(core::AdaptiveType::kNone);
  const std::string calm = digest_of(view, 100, 1);
  for (int taken = 3; taken < 40; taken += 9) {
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
    const auto again = film_of(view);
    for (int t = 0; t < film->tile_count(); ++t) {
      again->restore(t, film->tile(t), film->tile_revision(t));
    }
    NullSink sink;
    RenderTask task(renderer_of(view), again, options_of(0.02), sink);
    core::run_to_end(task, 2);
    EXPECT_EQ(again->digest(), calm) << taken;
  }
}

}  // namespace
