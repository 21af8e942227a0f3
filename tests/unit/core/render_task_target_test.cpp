// Jobs with an error target: the search for light edges, which goes on beside the picture, and progress.
#include <gtest/gtest.h>

#include <memory>

#include "core/render/render_task.h"
#include "tests/support/scenes.h"

namespace {

class SilentSink : public core::RenderSink {
 public:
  void on_tile(int /*tile*/, std::uint32_t /*revision*/) override {}
  void on_pass(const core::ConvergencePoint& /*point*/) override {}
  void on_finished(core::StopReason /*why*/) override {}
};

core::View small_view() {
  core::View view = test_support::view_of(test_support::build(test_support::cornell()), 70, 45);
  test_support::look_at(view, {0.5F, 0.5F, 2.2F}, {0.5F, 0.5F, 0}, 35);
  return view;
}

std::shared_ptr<const core::Renderer> renderer_of(const core::View& view) {
  auto renderer = core::Renderer::create(view);
  EXPECT_TRUE(renderer);
  return *renderer;
}

TEST(RenderTaskEdges, AreLookedForBesideThePicture) {
  for (const bool adaptive : {false, true}) {
    core::View view = small_view();
    view.settings.adaptive.type = adaptive ? core::AdaptiveType::kPilot : core::AdaptiveType::kNone;
    core::TaskOptions options;
    options.stop.samples_per_pixel = 48;
    options.slice_target_seconds = 1e-4;  // a sample of a tile, a few rows of the search
    if (!adaptive) {
      options.stop.relative_error = 1e-9;
    }
    SilentSink sink;
    const auto film = std::make_shared<core::Film>(view.settings);
    core::RenderTask task(renderer_of(view), film, options, sink);
    int searched = 0;
    int searched_last = 0;
    bool was_edges = false;
    bool first_picture_waited = false;
    while (const auto slice = task.take()) {
      const bool is_edges = slice->kind == core::SliceKind::kEdges;
      EXPECT_FALSE(is_edges && was_edges) << "the picture has every second slice at least";
      was_edges = is_edges;
      searched += is_edges ? 1 : 0;
      const int least = film->tile_samples(film->tile_count() - 1);
      searched_last = is_edges ? least : searched_last;
      first_picture_waited = first_picture_waited || (is_edges && least < 2);
      task.run(*slice);
    }
    EXPECT_EQ(task.stop_reason(), core::StopReason::kSamples);
    EXPECT_FALSE(first_picture_waited);
    EXPECT_GT(searched, 5);
    EXPECT_LT(searched_last, 32) << "known before anything needs it";
    EXPECT_GT(film->cpu_seconds(), 0);
  }
  // Jobs that will not need them do not look.
  for (const bool adaptive : {false, true}) {
    const int n = 14;
    core::View view = small_view();
    view.settings.adaptive.type = adaptive ? core::AdaptiveType::kPilot : core::AdaptiveType::kNone;
    SilentSink sink;
    core::TaskOptions options;
    options.stop.samples_per_pixel = n;
    core::RenderTask task(renderer_of(view), std::make_shared<core::Film>(view.settings), options, sink);
    while (const auto slice = task.take()) {
      EXPECT_NE(slice->kind, core::SliceKind::kEdges);
      task.run(*slice);
    }
  }
}

TEST(RenderTaskProgress, OfAnErrorTargetDoesNotFall) {
  for (const double target : {0.5, 0.15}) {
    const core::View view = small_view();
    SilentSink sink;
    core::TaskOptions options;
    options.stop.relative_error = target;
    core::RenderTask task(renderer_of(view), std::make_shared<core::Film>(view.settings), options, sink);
    double last = 0;
    double early = 1;
    while (!task.finished()) {
      const core::Progress p = task.progress();
      if (!task.finished()) {
        EXPECT_LT(p.fraction, 1);
        EXPECT_GE(p.fraction, last);
        last = p.fraction;
        early = p.samples_max < 4 ? last : early;
      }
      if (const auto slice = task.take()) {
        task.run(*slice);
      }
    }
    EXPECT_EQ(task.stop_reason(), core::StopReason::kRelativeError);
    EXPECT_GE(task.progress().samples_mean, 4) << "no earlier look may end it";
    EXPECT_LT(early, 0.2) << "nor did it seem so";
    EXPECT_EQ(task.progress().fraction, 1);
  }
}

}  // namespace
