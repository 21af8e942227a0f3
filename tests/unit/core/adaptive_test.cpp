// Sample plans; adaptive films are a function of the job, independent of threads, pauses, restarts
// and extensions.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <numeric>
#include <span>
#include <string>

#include <gtest/gtest.h>
#include <malloc.h>

#include "core/film/sample_plan.h"
#include "core/integrators/registry.h"
#include "core/layers/layers.h"
#include "core/render/task/allocation.h"
#include "core/render/task/eta.h"
#include "core/render/task/pass_plan.h"
#include "core/render/task/render_task.h"
#include "core/render/task/settle.h"
#include "core/settings/choices.h"
#include "core/settings/sample_sets.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"
#include "tests/support/tasks.h"

namespace {

using core::AdaptiveType;
using core::Film;
using core::RenderTask;
using test_support::renderer_of;
using test_support::samples;

TEST(SamplePlan, EachSampleBelongsToOneHalf) {
  for (const int replicates : {2, 4, 6}) {
    for (int n = 0; n < 40; ++n) {
      int count[2] = {0, 0};
      for (int s = 0; s < n; ++s) {
        const int half = s % replicates % 2;
        EXPECT_EQ(core::sample_of_half(static_cast<std::uint32_t>(count[half]), replicates, half),
                  s);
        ++count[half];
      }
      EXPECT_EQ(core::uniform_count(n, replicates, 0), count[0]);
      EXPECT_EQ(core::uniform_count(n, replicates, 1), count[1]);
    }
  }
}

TEST(SamplePlan, CountsStepFromOneEndToTheOther) {
  const core::PixelPlan plan = {16, 16 + 3 * 23};
  for (int x = 0; x < 50; ++x) {
    const core::PlanPosition at = {{32, 64}, 3, x, 3 * x};
    EXPECT_EQ(planned_count(plan, at, 32), 16U);
    EXPECT_EQ(planned_count(plan, at, 64), 16U + 3 * 23);
    std::uint32_t before = 16;
    for (int s = 32; s <= 64; ++s) {
      const std::uint32_t now = planned_count(plan, at, s);
      EXPECT_GE(now, before);
      EXPECT_EQ((now - 16) % 3, 0U);
      EXPECT_NEAR(now, 16 + 3 * 23 * (s - 32) / 32.0, 3);
      before = now;
    }
  }
}

core::Budget budget_of(int n, double mean, std::uint32_t has) {
  core::Budget budget;
  budget.has.assign(static_cast<std::size_t>(n), has);
  budget.mean = mean;
  test_support::Random random(1);
  for (int i = 0; i < n; ++i) {
    budget.need.push_back(i % 3 == 0 ? 0 : random.uniform());
  }
  return budget;
}

double mean_of(const std::vector<std::uint32_t>& counts) {
  return std::accumulate(counts.begin(), counts.end(), 0.0) / static_cast<double>(counts.size());
}

TEST(Allocation, KeepsTheMeanAndNeverReducesCounts) {
  for (const std::uint32_t step : {1U, 4U}) {
    core::Budget budget = budget_of(1000, 64, 32);
    budget.step = step;
    const auto counts = core::distribute(budget);
    EXPECT_NEAR(mean_of(counts), 64, step / 1000.0 + 1e-9);
    EXPECT_GE(*std::min_element(counts.begin(), counts.end()), 32U);
    EXPECT_GT(*std::max_element(counts.begin(), counts.end()), 100U);
  }
}

TEST(Allocation, IsProportionalToNeedAndSpreadsATenth) {
  const core::Budget budget = budget_of(1000, 5000, 0);
  const auto counts = core::distribute(budget);
  const double mean = std::accumulate(budget.need.begin(), budget.need.end(), 0.0) / 1000;
  for (std::size_t i = 0; i < 1000; ++i) {
    EXPECT_NEAR(counts[i], 5000 * (0.1 + 0.9 * static_cast<double>(budget.need[i]) / mean), 2) << i;
  }
}

TEST(Allocation, IsUniformWithoutNeed) {
  core::Budget budget = budget_of(100, 64, 32);
  std::fill(budget.need.begin(), budget.need.end(), 0.0F);
  for (const std::uint32_t n : core::distribute(budget)) {
    EXPECT_EQ(n, 64U);
  }
}

/// 32 samples of every pixel of two tiles. The pilot samples have radiance `mean` in the left tile
/// and 1 in the right one, a variance of 0.01, and two rays each.
std::unique_ptr<Film> calm_film(core::RenderSettings& settings, float mean, int side = 32) {
  settings.film.width = 2 * side;
  settings.film.height = side;
  settings.adaptive = {AdaptiveType::kPilot, 32, core::Granularity::kPixel, 0};
  auto film = std::make_unique<Film>(settings, core::PixelErrors::kIndependent, false);
  for (int t = 0; t < film->tile_count(); ++t) {
    core::TileState tile = film->tile(t);
    tile.samples = 32;
    for (core::ReplicatePixel& p : tile.pixels) {
      p = {1, 1, 1, 1, 0.15F, 16};
    }
    tile.pilot.assign(32 * 32,
                      core::PilotPixel{core::Rgb(t == 0 ? mean : 1), core::Rgb(0.02F), 1, 3});
    tile.pilot_samples = 3;
    film->commit(t, std::move(tile));
  }
  return film;
}

double mean_of_tile(const std::vector<core::PixelPlan>& plan) {
  double sum = 0;
  for (const core::PixelPlan& p : plan) {
    sum += p.to;
  }
  return sum / static_cast<double>(plan.size());
}

TEST(Allocation, NeedIsNoiseOverSignal) {
  core::RenderSettings settings;
  for (const auto& plan : core::make_plans(*calm_film(settings, 1), settings, 32)) {
    EXPECT_NEAR(mean_of_tile(plan), 32, 0.1);
  }
  // The same noise at a third of the radiance is three times the relative error, and the samples go
  // with its power of 2/3, 2.08; a tenth of them is uniform, and windows blend both sides.
  const auto plans = core::make_plans(*calm_film(settings, 1.0F / 3), settings, 32);
  const double ratio = mean_of_tile(plans[0]) / mean_of_tile(plans[1]);
  EXPECT_GT(ratio, 1.5);
  EXPECT_LT(ratio, 2.08);
  EXPECT_NEAR(mean_of_tile(plans[0]) + mean_of_tile(plans[1]), 64, 0.1);
}

TEST(Allocation, DarkPixelsCountAgainstATwentiethOfTheBrightnessOfTheImage) {
  core::RenderSettings settings;
  const auto black = core::make_plans(*calm_film(settings, 0), settings, 32);
  const auto dark = core::make_plans(*calm_film(settings, 1e-5F), settings, 32);
  EXPECT_NEAR(mean_of_tile(black[0]), mean_of_tile(dark[0]), 0.1);
}

// Sanitizers allocate their own memory.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
/// A value of this process's status, in bytes.
double status_bytes(const std::string& name) {
  std::ifstream status("/proc/self/status");
  std::string word;
  double kilobytes = 0;
  while (status >> word && word != name + ":") {
  }
  status >> kilobytes;
  return kilobytes * 1024;
}

TEST(Allocation, UsesTheStatedMemory) {
  ::mallopt(M_MMAP_THRESHOLD, 1 << 20);  // returns freed blocks at once, as in the server
  core::RenderSettings settings;
  const auto film = calm_film(settings, 1, 768);
  const double said =
      static_cast<double>(core::kPlanWorkBytes) * settings.film.width * settings.film.height;
  ::malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << 5;  // resets the peak
  const double before = status_bytes("VmRSS");
  const auto plans = core::make_plans(*film, settings, 32);
  const double took = status_bytes("VmHWM") - before;
  EXPECT_EQ(plans.size(), static_cast<std::size_t>(film->tile_count()));
  EXPECT_LT(took, 1.05 * said);
  EXPECT_GT(took, 0.95 * said);
}
#endif

TEST(Epochs, BeginAtErrorChecksAndThePilotIsAtMostATenth) {
  for (const int replicates : {2, 4, 8}) {
    for (const int least : {1, 7, 32, 100, 1000}) {
      core::RenderSettings settings;
      settings.replicates = replicates;
      settings.adaptive.type = AdaptiveType::kPilot;
      settings.adaptive.min_samples = least;
      int from = core::first_epoch(settings);
      EXPECT_GE(from, least);
      for (; from < 65536; from = core::epoch_end(from)) {
        EXPECT_EQ(core::next_check(from - 1, replicates), from);
        EXPECT_EQ(from % replicates, 0);
        EXPECT_GE(core::pilot_samples_at(from), 2);
        EXPECT_LE(core::pilot_samples_at(from), 0.1 * (from + core::pilot_samples_at(from)));
      }
    }
  }
}

// ---- Films.

core::View small_view(AdaptiveType type, int replicates = 2) {
  core::View view = test_support::cornell_view(70, 45, 50);
  view.settings.film.albedo = view.settings.film.normal = view.settings.film.depth = true;
  view.settings.max_depth = 2;
  view.settings.replicates = replicates;
  view.settings.seed = 42;
  view.settings.adaptive.type = type;
  view.settings.adaptive.min_samples = 8;  // the pilot starts at 20 samples
  return view;
}

std::string digest_of(const core::View& view, int count, int threads,
                      double slice_seconds = 0.0005) {
  const auto film = make_film(view.settings);
  core::NullSink sink;
  RenderTask task(renderer_of(view), film, samples(count, slice_seconds), sink);
  core::run_to_end(task, threads);
  EXPECT_NEAR(task.progress().samples_mean, count, 0.01 * count);
  return film->digest();
}

TEST(AdaptiveBits, AreIndependentOfThreadsAndSlices) {
  const core::View view = small_view(AdaptiveType::kPilot);
  const std::string one = digest_of(view, 60, 1);
  EXPECT_EQ(digest_of(view, 60, 2, 0.002), one);
  EXPECT_EQ(digest_of(view, 60, 7, 1), one);
  EXPECT_NE(digest_of(small_view(AdaptiveType::kNone), 60, 2), one) << "sampling was not adaptive";
}

TEST(AdaptiveBits, AreIndependentOfThreadsWithFourReplicates) {
  const core::View view = small_view(AdaptiveType::kPilot, 4);
  EXPECT_EQ(digest_of(view, 60, 7), digest_of(view, 60, 1, 1));
}

// Samplers without prefixes: whole sets in every replicate, for every count of a pixel.
TEST(AdaptiveBits, AreReproducibleForEverySamplerAndSetsAreWhole) {
  for (const auto& sampler : core::samplers()) {
    core::View view = small_view(AdaptiveType::kPilot);
    view.settings.film.width = 40;
    view.settings.film.height = 33;
    view.settings.sampler = sampler.value;
    const int unit = core::sample_unit(sampler.value, 2);
    const int count = core::rounded_samples(sampler.value, 2, 2 * core::first_epoch(view.settings));
    EXPECT_EQ(digest_of(view, count, 3), digest_of(view, count, 1, 1)) << sampler.name;
    const auto picture = test_support::render(view, count);
    EXPECT_LT(picture.progress.samples_min, picture.progress.samples_max) << sampler.name;
    for (const core::ReplicatePixel& p : picture.snapshot.pixels) {
      ASSERT_EQ(static_cast<int>(p.count) % std::max(unit / 2, 1), 0) << sampler.name;
    }
  }
}

// Stops after any number of slices, including pilot slices, and continues with another task.
TEST(AdaptiveBits, AreIndependentOfARestartAtAnyPoint) {
  const core::View view = small_view(AdaptiveType::kPilot);
  const auto renderer = renderer_of(view);
  const std::string whole = digest_of(view, 50, 2);
  core::NullSink sink;
  auto film = make_film(view.settings);
  bool over = false;
  int restarts = 0;
  while (!over) {
    RenderTask task(renderer, film, samples(50, 0.0005), sink);
    test_support::run_slices(task, 37);
    over = task.finished();
    film = test_support::restored(*film);
    ++restarts;
  }
  EXPECT_GT(restarts, 3);
  EXPECT_EQ(film->digest(), whole);
}

TEST(AdaptiveBits, AreIndependentOfPausesAndExtensions) {
  const core::View view = small_view(AdaptiveType::kPilot);
  const std::string whole = digest_of(view, 60, 2);
  auto film = make_film(view.settings);
  for (const int count : {30, 40, 60}) {  // within an epoch, at its end, in the next
    core::NullSink sink;
    RenderTask task(renderer_of(view), film, samples(count, 0.0005), sink);
    task.set_paused(true);
    EXPECT_FALSE(task.take());
    task.set_paused(false);
    core::run_to_end(task, 2);
    EXPECT_EQ(task.stop_reason(), core::StopReason::kSamples);
  }
  EXPECT_EQ(film->digest(), whole);
}

// The stop rules do not affect where samples go: a job that a clock stopped continues to the same
// film.
TEST(AdaptiveBits, AreIndependentOfAClockRule) {
  const core::View view = small_view(AdaptiveType::kPilot);
  auto film = make_film(view.settings);
  core::NullSink sink;
  core::TaskOptions options;
  options.stop.seconds = 0.15;
  options.samples_limit = 50;
  {
    RenderTask task(renderer_of(view), film, options, sink);
    core::run_to_end(task, 2);
  }
  RenderTask task(renderer_of(view), film, samples(50), sink);
  core::run_to_end(task, 2);
  EXPECT_EQ(film->digest(), digest_of(view, 50, 2));
}

TEST(AdaptiveFilms, HaveEqualHalvesAndTheRequestedMean) {
  const core::View view = small_view(AdaptiveType::kPilot);
  // the end of an epoch, exact to half a sample
  const auto picture = test_support::render(view, 80);
  const auto counts = core::layer_image(picture.snapshot, "samples");
  double sum = 0;
  float least = 1e9F;
  for (std::size_t i = 0; i < picture.snapshot.pixel_count(); ++i) {
    const auto a = core::half_value(picture.snapshot, i, 0).count;
    EXPECT_EQ(a, core::half_value(picture.snapshot, i, 1).count);
    EXPECT_EQ(counts->values[i], static_cast<float>(2 * a));
    sum += static_cast<double>(counts->values[i]);
    least = std::min(least, counts->values[i]);
  }
  EXPECT_NEAR(sum / static_cast<double>(picture.snapshot.pixel_count()), 80, 0.01);
  EXPECT_NEAR(picture.progress.samples_mean, 80, 0.01);
  EXPECT_GE(least, 20);
  EXPECT_LT(picture.progress.samples_min, 80);
  EXPECT_GT(picture.progress.samples_max, 80);
  EXPECT_EQ(picture.points.back().samples_per_pixel, 80);
}

TEST(AdaptiveFilms, ByTilesHaveOneCountPerTile) {
  core::View view = small_view(AdaptiveType::kPilot);
  view.settings.adaptive.granularity = core::Granularity::kTile;
  view.settings.adaptive.dilation = 0;
  const auto picture = test_support::render(view, 80);  // the end of an epoch
  for (int t = 0; t < picture.film->tile_count(); ++t) {
    const core::TileState tile = picture.film->tile(t);
    const auto [low, high] =
        std::minmax_element(tile.pixels.begin(), tile.pixels.end(),
                            [](const auto& a, const auto& b) { return a.count < b.count; });
    EXPECT_LE(high->count - low->count, 1U) << "rounding of each half";
  }
  EXPECT_GT(picture.progress.samples_max, picture.progress.samples_min + 2);
}

TEST(AdaptiveFilms, OfAJobTooSmallForADecisionEqualThePlainOne) {
  EXPECT_EQ(digest_of(small_view(AdaptiveType::kPilot), 8, 2),
            digest_of(small_view(AdaptiveType::kNone), 8, 2));
}

// ---- Time left.

TEST(TimeLeft, FollowsThePaceWithAnInterval) {
  std::vector<core::PacePoint> steady;
  for (int i = 0; i <= 10; ++i) {
    steady.push_back({2.0 * i, 10.0 * i});
  }
  const auto left = core::seconds_for(steady, 50);
  ASSERT_TRUE(left);
  EXPECT_NEAR(left->expected, 10, 1e-9);
  EXPECT_NEAR(left->low, 9.5, 1e-9);
  EXPECT_NEAR(left->high, 10 / 0.95, 1e-9);
  EXPECT_FALSE(core::seconds_for({steady.data(), 1}, 50));
  const auto early = core::seconds_for({steady.data(), 2}, 50);
  EXPECT_NEAR(early->low, 5, 1e-9);
  EXPECT_NEAR(early->high, 20, 1e-9);
}

// Ten passes of .7 and 1.3 s in turn, 8 samples each: residuals of .3, so that the pace has a
// relative standard error of sqrt(.9 * 10 / 9) / 10 = .1; two of them are .2 of 20 s.
TEST(TimeLeft, IsTwoStandardErrorsWide) {
  std::vector<core::PacePoint> points = {{0, 0}};
  for (int i = 0; i < 10; ++i) {
    const double seconds = i % 2 == 0 ? 0.7 : 1.3;
    points.push_back({points.back().elapsed_seconds + seconds, points.back().samples + 8});
  }
  const auto left = core::seconds_for(points, 160);
  ASSERT_TRUE(left);
  EXPECT_NEAR(left->expected, 20, 1e-9);
  EXPECT_NEAR(left->low, 16, 1e-9);
  EXPECT_NEAR(left->high, 25, 1e-9);
}

// Passes whose times vary by 30%: intervals of two standard errors cover the rest of the job in
// most of 500 trials. The rest also varies: 20 further passes after 10 have 0.58 of the variance of
// the pace; 2 of sqrt(1.5) is 1.6 deviations, 89%.
TEST(TimeLeft, CoversTheRemainingTimeOfVaryingPasses) {
  test_support::Random random(3);
  const auto pass = [&random] { return 1 + 0.3 * std::clamp(random.normal(), -3.0, 3.0); };
  int inside = 0;
  for (int trial = 0; trial < 500; ++trial) {
    std::vector<core::PacePoint> points = {{0, 0}};
    for (int i = 0; i < 10; ++i) {
      points.push_back({points.back().elapsed_seconds + pass(), points.back().samples + 8});
    }
    const auto left = core::seconds_for(points, 160);
    double truth = 0;
    for (int i = 0; i < 20; ++i) {
      truth += pass();
    }
    inside += left->low <= truth && truth <= left->high ? 1 : 0;
  }
  EXPECT_GE(inside, 400);
  EXPECT_LT(inside, 500) << "an interval that always covers is meaningless";
}

TEST(TimeLeft, EndsWithTheFirstRule) {
  const core::Remaining end = core::earlier({10, 8, 12}, {9, 9, 9});
  EXPECT_EQ(end.expected, 9);
  EXPECT_EQ(end.low, 8);
  EXPECT_EQ(end.high, 9);
  EXPECT_NEAR(core::samples_for_error(64, 0.2, 0.1), 256, 1e-9);
  EXPECT_NEAR(core::samples_for_error(64, 0.2, 0.1, 1), 128, 1e-9);
}

TEST(TimeLeft, UsesTheRecentDecreaseOfTheError) {
  std::vector<core::SeenError> seen;
  // Late fireflies: old errors are ignored.
  for (const double n : {2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0}) {
    seen.push_back({n, n < 8 ? 0.01 : std::pow(n, -0.7)});
  }
  EXPECT_NEAR(core::error_exponent(seen), 0.7, 1e-9);
  EXPECT_EQ(core::error_exponent(std::span(seen).first(3)), 0.5) << "too few errors";
  for (core::SeenError& s : seen) {
    s.error = std::pow(s.samples, -0.2);
  }
  EXPECT_EQ(core::error_exponent(seen), 0.5);
  for (core::SeenError& s : seen) {
    s.error = std::pow(s.samples, -1.4);
  }
  EXPECT_EQ(core::error_exponent(seen), 1);
  seen.back().error = std::nan("");
  EXPECT_EQ(core::error_exponent(seen), 0.5);
}

}  // namespace
