// Progress of jobs with an error target.
#include <memory>

#include <gtest/gtest.h>

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

TEST(RenderTaskProgress, OfAnErrorTargetDoesNotFall) {
  for (const double target : {0.5, 0.15}) {
    const core::View view = small_view();
    SilentSink sink;
    core::TaskOptions options;
    options.stop.relative_error = target;
    core::RenderTask task(renderer_of(view), std::make_shared<core::Film>(view.settings), options,
                          sink);
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
    EXPECT_LE(early, 0.75) << "three of at least four samples";
    EXPECT_EQ(task.progress().fraction, 1);
  }
}

}  // namespace
