// The content of a film is a function of the job alone; time and reason of a job's end.
#include "core/render/task/render_task.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include <gtest/gtest.h>

#include "core/render/task/settle.h"
#include "core/settings/choices.h"
#include "core/settings/sample_sets.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"
#include "tests/support/tasks.h"

namespace {

using core::Film;
using core::RenderTask;
using core::StopReason;
using core::StopRules;
using core::TaskOptions;
using test_support::renderer_of;
using test_support::restored;
using test_support::run_slices;
using test_support::samples;
using Clock = std::chrono::steady_clock;

/// Records the calls, and checks their order.
class RecordingSink : public core::RenderSink {
 public:
  void on_tile(int /*tile*/, std::uint32_t /*revision*/) override {
    ++tiles;
    after_end += finished > 0 ? 1 : 0;
  }
  void on_pass(const core::ConvergencePoint& point) override {
    ordered = ordered && point.samples_per_pixel > last_samples;
    last_samples = point.samples_per_pixel;
    after_end += finished > 0 ? 1 : 0;
    if (pass_hook) {
      pass_hook();
    }
  }
  void on_finished(StopReason why) override {
    ++finished;
    reason = why;
  }
  std::atomic<int> tiles = 0;
  std::atomic<int> finished = 0;
  std::atomic<int> after_end = 0;
  std::atomic<int> last_samples = 0;
  std::atomic<bool> ordered = true;
  StopReason reason = StopReason::kNone;
  std::function<void()> pass_hook;
};

core::View small_view(core::SamplerType sampler = core::SamplerType::kSobol) {
  core::View view = test_support::cornell_view(70, 45, 35);
  view.settings.sampler = sampler;
  view.settings.film.filter = {core::FilterType::kMitchell, 2};
  view.settings.film.albedo = view.settings.film.normal = view.settings.film.depth = true;
  view.settings.seed = 42;
  return view;
}

std::shared_ptr<Film> film_of(const core::View& view) {
  return std::make_shared<Film>(view.settings.film, view.settings.replicates);
}

std::string digest_of(const core::View& view, TaskOptions options, int threads) {
  const auto film = film_of(view);
  RecordingSink sink;
  RenderTask task(renderer_of(view), film, std::move(options), sink);
  core::run_to_end(task, threads);
  EXPECT_EQ(sink.finished, 1);
  EXPECT_EQ(sink.after_end, 0);
  return film->digest();
}

int tiles_apart(const Film& film) {
  int low = film.tile_samples(0);
  int high = low;
  for (int t = 1; t < film.tile_count(); ++t) {
    low = std::min(low, film.tile_samples(t));
    high = std::max(high, film.tile_samples(t));
  }
  return high - low;
}

TEST(RenderTaskBits, AreIndependentOfTheNumberOfThreads) {
  for (const auto& sampler : core::samplers()) {
    const core::View view = small_view(sampler.value);
    const std::string one = digest_of(view, samples(12), 1);
    EXPECT_EQ(digest_of(view, samples(12), 2), one) << sampler.name;
    EXPECT_EQ(digest_of(view, samples(12), 7), one) << sampler.name;
  }
}

TEST(RenderTaskBits, DependOnTheSeed) {
  core::View other = small_view();
  other.settings.seed = 43;
  EXPECT_NE(digest_of(other, samples(2), 2), digest_of(small_view(), samples(2), 2));
}

TEST(RenderTaskBits, AreIndependentOfTheSliceLength) {
  const core::View view = small_view();
  const std::string usual = digest_of(view, samples(12), 2);
  for (const double seconds : {1e-9, 1e-4, 100.0}) {
    EXPECT_EQ(digest_of(view, samples(12, seconds), 2), usual) << seconds;
  }
}

TEST(RenderTaskBits, AreIndependentOfKillAndResume) {
  test_support::Random random(3);
  for (int round = 0; round < 18; ++round) {
    const auto& sampler =
        core::samplers()[static_cast<std::size_t>(round) % core::samplers().size()];
    const core::View view = small_view(sampler.value);
    const auto renderer = renderer_of(view);
    const std::string whole = digest_of(view, samples(12), 2);
    auto film = film_of(view);
    // Killed up to three times, each time after several slices, with one slice lost.
    for (int kill = 0; kill < 3; ++kill) {
      RecordingSink sink;
      RenderTask task(renderer, film, samples(12, 1e-6), sink);
      run_slices(task, static_cast<int>(random.bits() % 25));
      (void)task.take();  // taken, never run
      film = restored(*film);
    }
    RecordingSink sink;
    RenderTask task(renderer, film, samples(12), sink);
    core::run_to_end(task, 2);
    EXPECT_EQ(film->digest(), whole) << round << " " << sampler.name;
  }
}

TEST(RenderTaskBits, AreIndependentOfCancelDuringASliceAndResume) {
  const core::View view = small_view();
  const auto renderer = renderer_of(view);
  const std::string whole = digest_of(view, samples(64), 2);
  for (const int delay_us : {500, 3000, 9000, 20000}) {
    auto film = film_of(view);
    {
      RecordingSink sink;
      RenderTask task(renderer, film, samples(64), sink);
      std::jthread killer([&] {
        std::this_thread::sleep_for(std::chrono::microseconds(delay_us));
        task.cancel();
      });
      core::run_to_end(task, 2);
    }
    film = restored(*film);
    RecordingSink sink;
    RenderTask task(renderer, film, samples(64), sink);
    core::run_to_end(task, 2);
    EXPECT_EQ(film->digest(), whole) << delay_us;
  }
}

TEST(RenderTaskBits, OfAnExtendedJobEqualThoseOfTheLongOne) {
  for (const auto& sampler : core::samplers()) {
    const core::View view = small_view(sampler.value);
    const auto film = film_of(view);
    for (const int target : {1, 6, 20}) {
      RecordingSink sink;
      RenderTask task(renderer_of(view), film, samples(target), sink);
      core::run_to_end(task, 2);
      EXPECT_EQ(film->tile_samples(0), core::rounded_samples(sampler.value, 2, target));
    }
    EXPECT_EQ(film->digest(), digest_of(view, samples(20), 1)) << sampler.name;
  }
}

TEST(RenderTaskBits, OfACropEqualThoseOfTheFullFilm) {
  core::View full = small_view();
  const auto whole = test_support::render(full, 6).snapshot;
  core::View part = full;
  part.settings.film.crop = core::PixelRect{21, 9, 37, 30};
  const auto piece = test_support::render(part, 6).snapshot;
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 37; ++x) {
      for (std::size_t r = 0; r < 2; ++r) {
        const auto& a = piece.pixels[static_cast<std::size_t>(y * 37 + x) * 2 + r];
        const auto& b = whole.pixels[static_cast<std::size_t>((y + 9) * 70 + x + 21) * 2 + r];
        ASSERT_TRUE(a.mean_r == b.mean_r && a.mean_g == b.mean_g && a.mean_b == b.mean_b &&
                    a.m2_luminance == b.m2_luminance && a.count == b.count);
      }
    }
  }
}

TEST(RenderTaskStop, RendersEveryRequestedSampleAndNoMore) {
  for (const int n : {1, 2, 3, 7, 16}) {
    const core::View view = small_view(core::SamplerType::kIndependent);
    const auto picture = test_support::render(view, n);
    EXPECT_EQ(picture.reason, StopReason::kSamples);
    EXPECT_EQ(tiles_apart(*picture.film), 0);
    EXPECT_EQ(picture.film->tile_samples(0), n);
    EXPECT_EQ(picture.progress.fraction, 1);
    EXPECT_EQ(picture.progress.rejected_samples, 0U);
    EXPECT_EQ(core::half_value(picture.snapshot, 0, 1).count, static_cast<unsigned>(n / 2));
  }
}

TEST(RenderTaskStop, SobolRoundsOddCountsUp) {
  EXPECT_EQ(test_support::render(small_view(), 5).film->tile_samples(0), 6);
  EXPECT_EQ(test_support::render(small_view(), 1).film->tile_samples(0), 1);
}

TEST(RenderTaskStop, RendersWholeSets) {
  for (const auto& sampler : core::samplers()) {
    const core::View view = small_view(sampler.value);
    const auto picture = test_support::render(view, 5);
    EXPECT_EQ(picture.film->tile_samples(0), core::rounded_samples(sampler.value, 2, 5))
        << sampler.name;
    EXPECT_EQ(picture.reason, StopReason::kSamples);
  }
}

// A job ended by its clock, and one ended by the server limit, hold whole sets.
TEST(RenderTaskStop, ClocksAndLimitsKeepWholeSets) {
  const core::View view = small_view(core::SamplerType::kOrthogonalArray);
  {
    const auto film = film_of(view);
    RecordingSink sink;
    TaskOptions options;
    options.stop.seconds = 0.25;
    options.slice_target_seconds = 1e-4;
    RenderTask task(renderer_of(view), film, options, sink);
    core::run_to_end(task, 2);
    EXPECT_EQ(tiles_apart(*film), 0);
    EXPECT_GE(film->tile_samples(0), 50);
    EXPECT_EQ(film->tile_samples(0) % 50, 0);
    EXPECT_EQ(film->digest(), digest_of(view, samples(film->tile_samples(0)), 2));
  }
  const auto film = film_of(view);
  RecordingSink sink;
  TaskOptions options;
  options.stop.relative_error = 1e-9;
  options.samples_limit = 130;
  RenderTask task(renderer_of(view), film, options, sink);
  core::run_to_end(task, 2);
  EXPECT_EQ(sink.reason, StopReason::kLimit);
  EXPECT_EQ(film->tile_samples(0), 100);
}

TEST(RenderTaskStop, ServerLimitEndsJobsWithoutAnotherRule) {
  const core::View view = small_view();
  for (const int asked : {0, 100, 8}) {
    const auto film = film_of(view);
    RecordingSink sink;
    TaskOptions options;
    options.samples_limit = 8;
    if (asked > 0) {
      options.stop.samples_per_pixel = asked;
    } else {
      options.stop.relative_error = 1e-9;
    }
    RenderTask task(renderer_of(view), film, options, sink);
    core::run_to_end(task, 2);
    EXPECT_EQ(sink.reason, asked == 8 ? StopReason::kSamples : StopReason::kLimit) << asked;
    EXPECT_EQ(film->tile_samples(0), 8);
  }
}

TEST(RenderTaskStop, SecondsKeepTheLastCompletePass) {
  const core::View view = small_view();
  const auto renderer = renderer_of(view);
  for (const double seconds : {0.02, 0.05, 0.11, -0.05, -0.11}) {
    const bool by_cpu = seconds < 0;
    const auto film = film_of(view);
    RecordingSink sink;
    TaskOptions options;
    (by_cpu ? options.stop.cpu_seconds : options.stop.seconds) = std::fabs(seconds);
    options.slice_target_seconds = 1e-4;
    RenderTask task(renderer, film, options, sink);
    core::run_to_end(task, 2);
    EXPECT_EQ(sink.reason, by_cpu ? StopReason::kCpuSeconds : StopReason::kSeconds);
    EXPECT_TRUE(!by_cpu || film->cpu_seconds() >= -seconds);
    EXPECT_EQ(tiles_apart(*film), 0) << seconds;
    const int n = film->tile_samples(0);
    EXPECT_GE(n, 1);
    EXPECT_EQ(film->digest(), digest_of(view, samples(n), 2));
  }
}

TEST(RenderTaskStop, PastDeadlineStillGivesOneCompletePass) {
  const core::View view = small_view();
  const auto film = film_of(view);
  RecordingSink sink;
  TaskOptions options;
  options.stop.deadline_unix_seconds = 1;
  RenderTask task(renderer_of(view), film, options, sink);
  core::run_to_end(task, 2);
  EXPECT_EQ(sink.reason, StopReason::kDeadline);
  EXPECT_EQ(tiles_apart(*film), 0);
  EXPECT_GE(film->tile_samples(0), 1);
}

TEST(RenderTaskStop, ClockKeepsACompletePassAfterARestartDuringAPass) {
  const core::View view = small_view();
  const auto renderer = renderer_of(view);
  auto film = film_of(view);
  {
    RecordingSink sink;
    RenderTask task(renderer, film, samples(64, 1e-9), sink);
    run_slices(task, 40);
    ASSERT_GT(tiles_apart(*film), 0) << "the test requires a film in the middle of a pass";
  }
  film = restored(*film);
  RecordingSink sink;
  TaskOptions options;
  options.stop.deadline_unix_seconds = 1;
  RenderTask task(renderer, film, options, sink);
  core::run_to_end(task, 2);
  EXPECT_EQ(sink.reason, StopReason::kDeadline);
  EXPECT_EQ(tiles_apart(*film), 0);
}

TEST(RenderTaskStop, ClockSetDuringAPassKeepsACompletePass) {
  const core::View view = small_view();
  const auto film = film_of(view);
  RecordingSink sink;
  RenderTask task(renderer_of(view), film, samples(64, 1e-9), sink);
  run_slices(task, 40);
  ASSERT_GT(tiles_apart(*film), 0);
  StopRules stop;
  stop.deadline_unix_seconds = 1;
  task.set_stop(stop);
  core::run_to_end(task, 2);
  EXPECT_EQ(sink.reason, StopReason::kDeadline);
  EXPECT_EQ(tiles_apart(*film), 0);
}

TEST(RenderTaskStop, ErrorChecksAreInOrderAndTheEndComesLast) {
  const core::View view = small_view();
  for (int round = 0; round < 5; ++round) {
    const auto film = film_of(view);
    RecordingSink sink;
    RenderTask task(renderer_of(view), film, samples(32), sink);
    core::run_to_end(task, 3);
    EXPECT_TRUE(sink.ordered);
    EXPECT_EQ(sink.after_end, 0);
    EXPECT_EQ(sink.last_samples, 32);
    EXPECT_EQ(task.points().back().samples_per_pixel, 32);
    EXPECT_GT(sink.tiles, 0);
  }
}

TEST(RenderTaskCancel, EndsWithinATenthOfASecond) {
  core::View view = test_support::cornell_view(480, 270, 35);
  const auto renderer = renderer_of(view);
  for (const int delay_ms : {5, 40, 90}) {
    const auto film = film_of(view);
    RecordingSink sink;
    RenderTask task(renderer, film, samples(65536), sink);
    std::atomic<double> taken = 0;
    std::jthread killer([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(delay_ms));
      const auto start = Clock::now();
      task.cancel();
      while (!task.finished()) {
        std::this_thread::sleep_for(std::chrono::microseconds(200));
      }
      taken = std::chrono::duration<double>(Clock::now() - start).count();
    });
    core::run_to_end(task, 2);
    killer.join();
    EXPECT_EQ(sink.reason, StopReason::kCancelled);
    EXPECT_EQ(sink.finished, 1);
#if !defined(__SANITIZE_THREAD__) && !defined(__SANITIZE_ADDRESS__)
    EXPECT_LT(taken, 0.1);
#endif
  }
}

TEST(RenderTaskCancel, BeforeTheFirstSliceEndsTheJob) {
  const core::View view = small_view();
  RecordingSink sink;
  RenderTask task(renderer_of(view), film_of(view), samples(4), sink);
  task.cancel();
  EXPECT_TRUE(task.finished());
  EXPECT_EQ(sink.reason, StopReason::kCancelled);
  task.cancel();
  EXPECT_EQ(sink.finished, 1);
  EXPECT_FALSE(task.take());
}

// A decision is in progress and no slice is: only the deciding thread can end the job.
TEST(RenderTaskCancel, DuringADecisionEndsTheJob) {
  const core::View view = small_view();
  for (const bool error_rule : {true, false}) {
    RecordingSink sink;
    TaskOptions options;
    options.samples_limit = 4096;
    if (error_rule) {
      options.stop.relative_error = 1e-6;
    } else {
      options.stop.samples_per_pixel = 4096;
    }
    RenderTask task(renderer_of(view), film_of(view), options, sink);
    sink.pass_hook = [&] { task.cancel(); };
    const auto start = Clock::now();
    while (!task.finished() && Clock::now() - start < std::chrono::seconds(5)) {
      if (const auto slice = task.take()) {
        task.run(*slice);
      }
    }
    EXPECT_TRUE(task.finished());
    EXPECT_EQ(sink.reason, StopReason::kCancelled);
    EXPECT_EQ(sink.finished, 1);
  }
}

TEST(RenderTaskPause, TakesNoSlicesAndStopsTheClock) {
  const core::View view = small_view();
  RecordingSink sink;
  RenderTask task(renderer_of(view), film_of(view), samples(8), sink);
  const auto slice = task.take();
  ASSERT_TRUE(slice);
  task.set_paused(true);
  task.run(*slice);
  EXPECT_FALSE(task.take());
  const double before = task.progress().elapsed_seconds;
  std::this_thread::sleep_for(std::chrono::milliseconds(30));
  EXPECT_EQ(task.progress().elapsed_seconds, before);
  task.set_paused(false);
  core::run_to_end(task, 2);
  EXPECT_EQ(sink.reason, StopReason::kSamples);
}

TEST(RenderTaskProgress, IsNeverCompleteBeforeTheEnd) {
  const core::View view = small_view();
  RecordingSink sink;
  RenderTask task(renderer_of(view), film_of(view), samples(8), sink);
  double last = 0;
  while (!task.finished()) {
    const core::Progress p = task.progress();
    if (!task.finished()) {
      EXPECT_LT(p.fraction, 1);
      EXPECT_GE(p.fraction, last);
      last = p.fraction;
    }
    if (const auto slice = task.take()) {
      task.run(*slice);
    }
  }
  EXPECT_EQ(task.progress().fraction, 1);
  EXPECT_EQ(task.progress().samples_mean, 8);
}

}  // namespace
