// Comparisons of jobs that differ only in their seed have the stated false alarm rate; a gain of
// 1% is found.

#include "core/compare/comparison.h"

#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/least_covered.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::Picture;

constexpr int kWidth = 64;
constexpr int kHeight = 64;

/// Box with emitter and walls: edges, penumbrae, no mirrors.
Picture rendered(std::uint64_t seed, int samples, core::SamplerType sampler, int replicates = 2) {
  static const auto scene = test_support::build(test_support::cornell());
  core::View view = test_support::view_of(scene, kWidth, kHeight);
  test_support::look_at(view, {0.5F, 0.5F, 2.2F}, {0.5F, 0.5F, 0}, 38);
  view.settings.seed = seed;
  view.settings.sampler = sampler;
  view.settings.max_depth = 5;
  view.settings.replicates = replicates;
  return core::picture_of(test_support::render(view, samples).snapshot);
}

core::Comparison compared(const Picture& a, const Picture& b) {
  auto result = core::compare_pictures(a, b);
  CHECK(result);
  return *std::move(result);
}

void scale(Picture& picture, float gain) {
  for (std::size_t i = 0; i < picture.values.size(); ++i) {
    picture.values[i] *= gain;
    picture.half_difference[i] *= gain;
  }
  picture.mean_variance *= static_cast<double>(gain) * static_cast<double>(gain);
}

struct Summary {
  test_support::Moments z_mean;
  test_support::Moments z_variance;
  test_support::Moments share;
  int bias_covered = 0;
};

/// Of 12 intervals; the seeds are fixed. They cannot tell 90% from 95%: the quantiles have closed
/// forms (tests/unit/core/interval_test.cpp), as does the variance of Gaussian noise
/// (comparison_test.cpp, 1,600 intervals).
const double kCoveredLeast = test_support::least_covered(12);

Summary null_pairs(core::SamplerType sampler, std::uint64_t pairs, int samples, float gain) {
  Summary summary;
  for (std::uint64_t pair = 0; pair < pairs; ++pair) {
    Picture a = rendered(2 * pair, samples, sampler);
    scale(a, gain);
    const auto result = compared(a, rendered(2 * pair + 1, samples, sampler));
    summary.z_mean.add(result.z_mean);
    summary.z_variance.add(result.z_variance);
    summary.share.add(result.z_share_above_3);
    summary.bias_covered += result.bias_low <= 0 && 0 <= result.bias_high ? 1 : 0;
  }
  return summary;
}

class NullComparison : public testing::TestWithParam<core::SamplerType> {};

TEST_P(NullComparison, HasItsStatedFalseAlarmRate) {
  const Summary summary = null_pairs(GetParam(), 12, 32, 1);
  // 12 pairs of 4096 pixels: the standard error of the mean of z is 1 / sqrt(12 * 4096) = 0.0045; 4
  // of them, a false alarm in 16,000.
  EXPECT_LT(std::abs(summary.z_mean.mean), 4 * 0.0045);
  // "About": half of a pixel's variance comes from its neighbours, which is too much for some and
  // too little for others. Slightly below 1, because the variance of a pixel with a large deviation
  // is also estimated higher.
  std::printf("    z variance %.3f beyond 3 %.3f %%\n", summary.z_variance.mean,
              100 * summary.share.mean);
  EXPECT_NEAR(summary.z_variance.mean, 1, 0.1);
  // 0.27% of 49,152 are 133; the counts of pairs vary like 12 binomials, 4 of their deviations are
  // 0.09%.
  EXPECT_LT(summary.share.mean, 0.0027 + 0.0009);
  EXPECT_GT(summary.share.mean, 0.0002);
  EXPECT_GE(summary.bias_covered, kCoveredLeast);
}

INSTANTIATE_TEST_SUITE_P(Statistical, NullComparison,
                         testing::Values(core::SamplerType::kSobol,
                                         core::SamplerType::kIndependent));

// Four samples in each half: windows with unequal noise, and pixels without noise, would make z too
// small.
TEST(Comparison, ZOfFewSamplesHasTheExpectedSpread) {
  const Summary summary = null_pairs(core::SamplerType::kSobol, 12, 8, 1);
  std::printf("    z variance %.3f beyond 3 %.3f %%\n", summary.z_variance.mean,
              100 * summary.share.mean);
  EXPECT_NEAR(summary.z_variance.mean, 1, 0.13);
  EXPECT_LT(summary.share.mean, 0.0027 + 0.0009);
  EXPECT_GE(summary.bias_covered, kCoveredLeast);
}

// An emitter in the image: its pixels and the black ones around it have no noise, and the noise of
// their neighbours does not apply to them.
TEST(Comparison, LeavesOutPixelsWithoutNoiseNextToNoisyOnes) {
  core::Picture a;
  a.width = 8;
  a.height = 8;
  core::Picture b = a;
  test_support::Random random(5);
  for (core::Picture* side : {&a, &b}) {
    for (int i = 0; i < 64; ++i) {
      const bool noisy = i % 2 == 0;
      side->values.push_back(core::Rgb(noisy ? 1 + 0.1F * static_cast<float>(random.normal()) : 1));
      side->half_difference.push_back(
          core::Rgb(noisy ? 0.1F * static_cast<float>(random.normal()) : 0));
      side->sample_variance.push_back(noisy ? 0.01F : 0);
    }
  }
  b.values[1] = core::Rgb(1.5F);
  const core::Comparison result = compared(a, b);
  EXPECT_EQ(result.z[3], 0);
  EXPECT_NE(result.z[1], 0) << "a difference is detected, independent of the samples";
  EXPECT_NE(result.z[0], 0);
}

TEST(Comparison, FindsAGainOfOnePercent) {
  // The planted fault: the same pairs with one side 1% brighter. 4 standard deviations of the mean
  // of 6 * 4096 values of z.
  const Summary summary = null_pairs(core::SamplerType::kSobol, 6, 64, 1.01F);
  EXPECT_GT(summary.z_mean.mean, 4 / std::sqrt(6.0 * 4096));
  EXPECT_LE(summary.bias_covered, 1);
}

// Blue-noise samples: the errors of neighbouring pixels cancel, so squared errors do not add up
// over the image.
std::vector<std::pair<Picture, Picture>> correlated_pairs(int replicates) {
  std::vector<std::pair<Picture, Picture>> out;
  const auto render = [replicates](std::uint64_t seed) {
    return rendered(seed, 4 * replicates, core::SamplerType::kZsobol, replicates);
  };
  for (std::uint64_t pair = 0; pair < 12; ++pair) {
    out.emplace_back(render(2 * pair), render(2 * pair + 1));
  }
  return out;
}

int covered(std::vector<std::pair<Picture, Picture>> pairs, float gain) {
  int out = 0;
  for (auto& [a, b] : pairs) {
    scale(a, gain);
    const auto result = compared(a, b);
    out += result.bias_low <= 0 && 0 <= result.bias_high ? 1 : 0;
  }
  return out;
}

TEST(Comparison, ReplicatesCoverTheBiasOfCorrelatedImages) {
  EXPECT_GE(covered(correlated_pairs(2), 1), kCoveredLeast);
  const auto pairs = correlated_pairs(16);
  EXPECT_GE(covered(pairs, 1), kCoveredLeast);
  EXPECT_LE(covered(pairs, 1.05F), 1) << "the planted fault: a gain";
}

}  // namespace
