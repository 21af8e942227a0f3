// Jobs with an error target: the search for light edges, which goes on beside the picture, and progress.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <stop_token>
#include <utility>
#include <vector>

#include "core/base/mutex.h"
#include "core/render/render_task.h"
#include "tests/support/caustic.h"
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

/// Another renderer's work, and a list of what was probed.
class Recording : public core::Renderer {
 public:
  explicit Recording(std::shared_ptr<const core::Renderer> of) : of_(std::move(of)) {}
  const core::View& view() const noexcept override { return of_->view(); }
  bool render(core::TileState& state, int last_sample, std::stop_token stop) const override { return of_->render(state, last_sample, stop); }
  bool render_pilot(core::TileState& state, int last_sample, std::stop_token stop) const override {
    return of_->render_pilot(state, last_sample, stop);
  }
  std::unique_ptr<core::LightEdgeSearch> light_edge_search() const override { return of_->light_edge_search(); }
  std::vector<core::ProbedPixel> probe(std::span<const std::uint32_t> pixels, int samples, std::stop_token stop) const override {
    {
      const core::MutexLock lock(mutex_);
      for (const std::uint32_t pixel : pixels) {
        probed_.emplace_back(pixel, samples);
      }
    }
    return of_->probe(pixels, samples, stop);
  }
  std::vector<std::pair<std::uint32_t, int>> probed() const {
    const core::MutexLock lock(mutex_);
    return probed_;
  }

 private:
  std::shared_ptr<const core::Renderer> of_;
  mutable core::Mutex mutex_;
  mutable std::vector<std::pair<std::uint32_t, int>> probed_ GUARDED_BY(mutex_);
};

TEST(RenderTaskProbes, AreSlicesThatADecisionWaitsForAndAreMadeOnce) {
  const core::View view = test_support::caustic();
  core::TaskOptions options;
  options.stop.relative_error = 0.25;
  std::vector<std::vector<core::ConvergencePoint>> points;
  for (const int threads : {0, 4}) {  // 0: by hand
    SilentSink sink;
    const auto recording = std::make_shared<Recording>(renderer_of(view));
    core::RenderTask task(recording, std::make_shared<core::Film>(view.settings), options, sink);
    if (threads > 0) {
      core::run_to_end(task, threads);
    }
    int probes = 0;
    while (!task.finished()) {
      const auto slice = task.take();
      ASSERT_TRUE(slice);
      const std::size_t decided = task.points().size();
      probes += slice->kind == core::SliceKind::kProbe ? 1 : 0;
      if (slice->kind == core::SliceKind::kProbe) {
        const auto beside = task.take();  // until it is made there are others of its kind, or nothing
        EXPECT_TRUE(!beside || beside->kind == core::SliceKind::kProbe);
        EXPECT_EQ(task.points().size(), decided) << "nothing is decided before it is made";
        if (beside) {
          ++probes;
          task.run(*beside);
        }
      }
      task.run(*slice);
    }
    EXPECT_EQ(task.stop_reason(), core::StopReason::kRelativeError);
    auto probed = recording->probed();
    EXPECT_GT(probed.size(), 10U);
    EXPECT_TRUE(threads > 0 || static_cast<std::size_t>(probes) == probed.size());
    std::sort(probed.begin(), probed.end());
    EXPECT_EQ(std::adjacent_find(probed.begin(), probed.end()), probed.end()) << "known from an earlier look";
    points.push_back(task.points());
  }
  ASSERT_EQ(points[0].size(), points[1].size());
  for (std::size_t i = 0; i < points[0].size(); ++i) {
    EXPECT_EQ(points[0][i].samples_per_pixel, points[1][i].samples_per_pixel);
    EXPECT_EQ(points[0][i].error.relative_rmse, points[1][i].error.relative_rmse);
  }
}

// While a decision waits for probes, a cancellation ends the job and a pause holds it.
TEST(RenderTaskProbes, CanBePausedAndCancelled) {
  const core::View view = test_support::caustic();
  core::TaskOptions options;
  options.stop.relative_error = 0.25;
  SilentSink sink;
  core::RenderTask task(renderer_of(view), std::make_shared<core::Film>(view.settings), options, sink);
  auto slice = task.take();
  while (slice && slice->kind != core::SliceKind::kProbe) {
    task.run(*slice);
    slice = task.take();
  }
  ASSERT_TRUE(slice);
  task.set_paused(true);
  task.run(*slice);
  EXPECT_FALSE(task.take());
  task.set_paused(false);
  slice = task.take();
  ASSERT_TRUE(slice);
  EXPECT_EQ(slice->kind, core::SliceKind::kProbe);
  task.cancel();
  EXPECT_FALSE(task.finished()) << "one is out";
  task.run(*slice);
  EXPECT_TRUE(task.finished());
  EXPECT_EQ(task.stop_reason(), core::StopReason::kCancelled);
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
