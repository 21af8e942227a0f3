// The next action of a task, without a task.
#include "core/render/task/pass_policy.h"

#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace {

using core::Pass;
using core::PassPolicy;
using core::StopReason;
using core::StopRules;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

PassPolicy policy(const StopRules& stop, int limit = 65536) {
  return PassPolicy(core::RenderSettings{}, stop, limit);
}

StopRules samples(int count) {
  StopRules stop;
  stop.samples_per_pixel = count;
  return stop;
}

StopRules error_target(double target) {
  StopRules stop;
  stop.relative_error = target;
  return stop;
}

TEST(PassPolicy, TilesRunAheadToTheNextErrorCheck) {
  const PassPolicy by = policy(samples(100));
  Pass pass;
  pass.base = pass.target = 64;
  EXPECT_EQ(by.barrier(pass), 80);
  EXPECT_EQ(by.next_target(pass), 72) << "passes are at most an eighth";
  pass.target = 72;
  EXPECT_EQ(by.next_target(pass), 80);
  pass.target = 80;
  EXPECT_EQ(by.next_target(pass), 80) << "no tile exceeds it";
  pass.base = 96;
  pass.target = 96;
  EXPECT_EQ(by.barrier(pass), 100);
}

TEST(PassPolicy, WithoutTilesPassesAreAsFewAsErrorChecksAllow) {
  Pass pass;
  const auto far = [&pass](const StopRules& stop, int from) {
    pass.base = pass.target = from;
    return policy(stop).far_target(pass);
  };
  EXPECT_EQ(far(samples(100), 0), 2) << "a first image";
  EXPECT_EQ(far(samples(100), 2), 8);
  EXPECT_EQ(far(samples(100), 8), 32);
  EXPECT_EQ(far(samples(100), 32), 100);
  EXPECT_EQ(far(samples(64), 8), 64) << "no short pass at the end";
  EXPECT_EQ(far(samples(65), 8), 32);
  EXPECT_EQ(far(error_target(0.01), 64), 80) << "the job may end there";
  StopRules clock = samples(1000);
  clock.seconds = 10;
  EXPECT_EQ(far(clock, 64), 72) << "less is lost when the time is up";
  pass.planned_to = 40;
  EXPECT_EQ(far(samples(100), 32), 40);
}

TEST(PassPolicy, RunsOnePassAtATimeWithAClock) {
  StopRules stop = samples(1000);
  stop.seconds = 10;
  const PassPolicy by = policy(stop);
  Pass pass;
  pass.base = 64;
  pass.target = 72;
  EXPECT_EQ(by.barrier(pass), 72);
  pass.base = 72;
  EXPECT_EQ(by.barrier(pass), 80);
}

TEST(PassPolicy, NoTileExceedsThePlan) {
  StopRules stop = samples(1000);
  Pass pass;
  pass.base = pass.target = 70;
  pass.planned_to = 74;
  EXPECT_EQ(policy(stop).barrier(pass), 74);
  EXPECT_EQ(policy(stop).next_target(pass), 74);
  stop.seconds = 1;
  EXPECT_EQ(policy(stop).barrier(pass), 74);
}

TEST(PassPolicy, ErrorChecksAreAQuarterOfAnOctaveApartAndAtTheEnd) {
  const PassPolicy by = policy(samples(100));
  for (const int at : {2, 4, 6, 16, 20, 28, 64, 80, 96, 100}) {
    EXPECT_TRUE(by.checks_at(at)) << at;
  }
  for (const int at : {18, 22, 72, 88, 98}) {
    EXPECT_FALSE(by.checks_at(at)) << at;
  }
}

TEST(PassPolicy, EndsAtTheRequestedSamplesOrAtTheServerLimit) {
  EXPECT_EQ(policy(samples(64)).decide(63, kInfinity), StopReason::kNone);
  EXPECT_EQ(policy(samples(64)).decide(64, kInfinity), StopReason::kSamples);
  EXPECT_EQ(policy(samples(64), 32).decide(32, kInfinity), StopReason::kLimit);
  EXPECT_EQ(policy(error_target(0.1), 32).decide(32, 0.6), StopReason::kLimit);
  EXPECT_EQ(policy(samples(63)).samples_max(), 64) << "sobol requires even counts";
}

// Alone the rule ends a job; beside an error target it is a condition, and limits end it anyway.
TEST(PassPolicy, LightThatIsMissingKeepsAJobFromEnding) {
  StopRules alone = samples(1000);
  alone.light_not_found = 0.02;
  EXPECT_EQ(policy(alone).decide(8, kInfinity, kInfinity, 0.02), StopReason::kLightNotFound);
  EXPECT_EQ(policy(alone).decide(8, kInfinity, kInfinity, 0.021), StopReason::kNone);
  EXPECT_EQ(policy(alone).decide(8, kInfinity), StopReason::kNone) << "unknown";
  EXPECT_EQ(policy(alone).decide(1000, kInfinity, kInfinity, 0.5), StopReason::kSamples);
  StopRules both = error_target(0.1);
  both.light_not_found = 0.02;
  EXPECT_EQ(policy(both).decide(8, 0.05, kInfinity, 0.5), StopReason::kNone);
  EXPECT_EQ(policy(both).decide(8, 0.5, kInfinity, 0.01), StopReason::kNone);
  EXPECT_EQ(policy(both).decide(8, 0.05, kInfinity, 0.01), StopReason::kRelativeError);
  StopRules denoised;
  denoised.denoised_error = 0.1;
  denoised.light_not_found = 0.02;
  EXPECT_EQ(policy(denoised).decide(8, kInfinity, 0.05, 0.5), StopReason::kNone);
  EXPECT_EQ(policy(denoised).decide(8, kInfinity, 0.05, 0.01), StopReason::kDenoisedError);
  EXPECT_FALSE(policy(both).allows_missing(0.5));
  EXPECT_TRUE(policy(samples(8)).allows_missing(kInfinity));
}

TEST(PassPolicy, ErrorTargetRequiresTheUpperEndBelowIt) {
  const PassPolicy by = policy(error_target(0.1));
  EXPECT_EQ(by.decide(64, 0.1), StopReason::kRelativeError);
  EXPECT_EQ(by.decide(64, 0.11), StopReason::kNone);
  EXPECT_EQ(by.decide(64, kInfinity), StopReason::kNone)
      << "without an error check the job continues";
  EXPECT_EQ(by.decide(64, std::numeric_limits<double>::quiet_NaN()), StopReason::kNone);
}

TEST(PassPolicy, FewSamplesMeetNoErrorTargetUnlessTheyAreAll) {
  const PassPolicy by = policy(error_target(0.1));
  const int first = by.stop_at(1);
  EXPECT_EQ(by.decide(first - 1, 0.02), StopReason::kNone);
  EXPECT_EQ(by.decide(first, 0.02), StopReason::kRelativeError);
  StopRules both = error_target(0.1);
  both.samples_per_pixel = 2;
  EXPECT_EQ(policy(both).decide(2, 0.02), StopReason::kRelativeError);
}

TEST(PassPolicy, RequestsADenoisedErrorTwiceAnOctaveFromFourSamplesOn) {
  StopRules stop;
  stop.denoised_error = 0.1;
  const PassPolicy by = policy(stop, 100);
  std::vector<int> checks;
  for (int n = 1; n <= 100; ++n) {
    if (by.checks_at(n) && by.denoises_at(n)) {
      checks.push_back(n);
    }
  }
  EXPECT_EQ(checks, (std::vector<int>{4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 100}));
  EXPECT_FALSE(policy(samples(100)).denoises_at(16)) << "not requested";
  EXPECT_EQ(by.decide(16, kInfinity, 0.11), StopReason::kNone);
  EXPECT_EQ(by.decide(16, kInfinity, 0.09), StopReason::kDenoisedError);
  EXPECT_EQ(by.decide(2, kInfinity, 0.09), StopReason::kNone);
}

TEST(PassPolicy, ReportsTheNextErrorCheckThatMayEndAJob) {
  const PassPolicy by = policy(error_target(0.1), 100);
  EXPECT_EQ(by.stop_at(65), 80);
  EXPECT_EQ(by.stop_at(80), 80);
  EXPECT_EQ(by.stop_at(99), 100);
  EXPECT_EQ(by.stop_at(1e9), 100);
  EXPECT_EQ(by.stop_at(std::numeric_limits<double>::infinity()), 100);
  EXPECT_EQ(by.stop_at(std::numeric_limits<double>::quiet_NaN()), 100);
}

// One tile of 1,024 pixels: grain 0.05, doubt 1/8, z = q sqrt(2 * 2) / 1024.
TEST(PassPolicy, ErrorsAreBoundedWithTheConfidenceOfTheJob) {
  core::TileSums sums;
  sums.pixels = 1024;
  sums.grain = 1024 * 0.05;
  sums.squares = 2;
  sums.doubt = 128;
  sums.has_halves = true;
  const core::ErrorEstimate check(std::vector{sums}, core::PixelErrors::kIndependent);
  StopRules stop = error_target(0.01);
  for (const auto& [confidence, quantile] :
       {std::pair(0.5, 0.674490), std::pair(0.95, 1.959964), std::pair(0.999, 3.290527)}) {
    stop.confidence = confidence;
    for (const bool worst_tile : {false, true}) {
      stop.worst_tile = worst_tile;
      EXPECT_NEAR(policy(stop).error_bound(check), 0.05 + 0.125 + quantile * 2 / 1024, 1e-8)
          << confidence;
    }
  }
}

}  // namespace
