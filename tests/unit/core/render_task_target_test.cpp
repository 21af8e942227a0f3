// Jobs with an error target.
#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "core/film/meter_reading.h"
#include "core/integrators/registry.h"
#include "core/render/task/render_task.h"
#include "core/render/task/settle.h"
#include "tests/support/scenes.h"
#include "tests/support/tasks.h"

namespace {

using test_support::renderer_of;

core::View small_view() { return test_support::cornell_view(70, 45, 35); }

TEST(RenderTaskProgress, OfAnErrorTargetDoesNotDecrease) {
  for (const double target : {0.5, 0.15}) {
    const core::View view = small_view();
    core::NullSink sink;
    core::TaskOptions options;
    options.stop.relative_error = target;
    core::RenderTask task(renderer_of(view), core::make_film(view.settings), options, sink);
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
    EXPECT_GE(task.progress().samples_mean, 4) << "no earlier error check may end it";
    EXPECT_LE(early, 0.75) << "three of at least four samples";
    EXPECT_EQ(task.progress().fraction, 1);
  }
}

// The same film at each confidence: z grows as the normal quantile.
TEST(RenderTaskTarget, ErrorHasTheConfidenceOfTheJob) {
  const core::View view = small_view();
  const auto renderer = renderer_of(view);
  std::vector<double> reaches;
  for (const double confidence : {0.5, 0.95, 0.999}) {
    core::NullSink sink;
    core::TaskOptions options;
    options.stop.samples_per_pixel = 8;
    options.stop.confidence = confidence;
    core::RenderTask task(renderer, core::make_film(view.settings), options, sink);
    core::run_to_end(task, 2);
    reaches.push_back(task.progress().error.reach);
  }
  ASSERT_GT(reaches[1], 0);
  EXPECT_NEAR(reaches[0] / reaches[1], 0.674490 / 1.959964, 1e-5);
  EXPECT_NEAR(reaches[2] / reaches[1], 3.290527 / 1.959964, 1e-5);
}

/// A process may end between the last slice of a pass and the decision that follows it.
TEST(RenderTaskTarget, IsDecidedAfterARestartAtTheCheckThatMeetsIt) {
  const core::View view = small_view();
  const auto renderer = renderer_of(view);
  for (const bool is_denoised : {false, true}) {
    core::NullSink sink;
    core::TaskOptions options;
    (is_denoised ? options.stop.denoised_error : options.stop.relative_error) = 0.15;
    options.denoised_bound = [](const core::Film& film, double /*confidence*/) {
      return 1 / film.sample_counts().mean;
    };
    const auto film = core::make_film(view.settings);
    core::RenderTask task(renderer, film, options, sink);
    core::run_to_end(task, 2);
    const auto restored = test_support::restored(*film);
    core::RenderTask again(renderer, restored, options, sink);
    core::run_to_end(again, 2);
    EXPECT_EQ(again.stop_reason(), task.stop_reason());
    EXPECT_EQ(restored->digest(), film->digest());
    EXPECT_EQ(again.points().back().error.high, task.points().back().error.high);
  }
}

/// Sample counts at which the task requests the bound of its denoised image, which is 1 over the
/// count.
struct Asked {
  std::vector<double> samples;
  std::vector<double> confidences;

  core::TaskOptions options(double target) {
    core::TaskOptions out;
    out.stop.denoised_error = target;
    out.denoised_bound = [this](const core::Film& film, double confidence) {
      samples.push_back(film.sample_counts().mean);
      confidences.push_back(confidence);
      return 1 / samples.back();
    };
    return out;
  }
};

TEST(RenderTask, EndsWhenEveryPointOfTheMeterMeetsItsTarget) {
  core::View view = small_view();
  view.settings.meter.points = {{{0.5F, 0.001F, 0.9F}, {0, 1, 0}},
                                {{0.9F, 0.001F, 0.9F}, {0, 1, 0}}};
  int before = 0;
  for (const double target : {0.2, 0.04}) {
    core::NullSink sink;
    core::TaskOptions options;
    options.stop.meter_error = target;
    options.stop.samples_per_pixel = 1024;
    auto film = core::make_film(view.settings);
    core::RenderTask task(renderer_of(view), film, options, sink);
    core::run_to_end(task, 2);
    EXPECT_EQ(task.stop_reason(), core::StopReason::kMeterError) << target;
    EXPECT_GT(task.progress().samples_max, before);
    before = task.progress().samples_max;
    const auto readings =
        core::meter_readings(core::meter_points(view.settings.meter), film->meter());
    ASSERT_EQ(readings.size(), 2U);
    double worst = 0;
    for (const core::MeterReading& reading : readings) {
      worst = std::max(worst, (reading.high - reading.low) / reading.illuminance);
    }
    EXPECT_LE(worst, target);
    EXPECT_EQ(worst, core::meter_error(readings));
  }
}

TEST(MeterError, IsInfiniteWithoutAReading) {
  EXPECT_TRUE(std::isinf(core::meter_error({})));
  EXPECT_TRUE(std::isinf(core::meter_error({core::MeterReading{}})));
}

TEST(RenderTask, EndsWhenTheDenoisedBoundMeetsItsTarget) {
  const core::View view = small_view();
  core::NullSink sink;
  Asked asked;
  core::RenderTask task(renderer_of(view), core::make_film(view.settings), asked.options(0.1),
                        sink);
  core::run_to_end(task, 2);
  EXPECT_EQ(task.stop_reason(), core::StopReason::kDenoisedError);
  EXPECT_EQ(asked.samples, (std::vector<double>{4, 6, 8, 12}));
  for (const double confidence : asked.confidences) {
    EXPECT_DOUBLE_EQ(confidence, 0.95);
  }
}

TEST(RenderTask, UsesItsOtherRulesWithoutADenoiser) {
  const core::View view = small_view();
  core::NullSink sink;
  core::TaskOptions options;
  options.stop.denoised_error = 10;
  options.stop.samples_per_pixel = 8;
  core::RenderTask task(renderer_of(view), core::make_film(view.settings), options, sink);
  core::run_to_end(task, 2);
  EXPECT_EQ(task.stop_reason(), core::StopReason::kSamples);
}

// A job that was stopped in the middle and resumed ends with the same samples.
TEST(RenderTask, ResumesToTheSameDenoisedTarget) {
  const core::View view = small_view();
  core::NullSink sink;
  const auto film = core::make_film(view.settings);
  core::TaskOptions first;
  first.stop.samples_per_pixel = 6;
  core::RenderTask before(renderer_of(view), film, first, sink);
  core::run_to_end(before, 2);
  Asked asked;
  core::RenderTask after(renderer_of(view), film, asked.options(0.1), sink);
  core::run_to_end(after, 2);
  EXPECT_EQ(after.stop_reason(), core::StopReason::kDenoisedError);
  EXPECT_EQ(asked.samples, (std::vector<double>{6, 8, 12})) << "where it stopped, it had no target";
}

}  // namespace
