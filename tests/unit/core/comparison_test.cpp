#include "core/compare/comparison.h"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/statistics.h"

namespace {

using core::Picture;
using core::Rgb;

Picture exact(int width, int height, Rgb value) {
  Picture picture;
  picture.width = width;
  picture.height = height;
  picture.values.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), value);
  picture.is_exact = true;
  return picture;
}

/// Gaussian noise around `mean`, two halves; sigma(x): standard error of the value in column x.
template <typename Sigma>
Picture noisy(int width, int height, float mean, std::uint64_t seed, const Sigma& sigma) {
  Picture picture = exact(width, height, {});
  picture.is_exact = false;
  test_support::Random random(seed);
  for (std::size_t i = 0; i < picture.values.size(); ++i) {
    const float s = sigma(static_cast<int>(i % static_cast<std::size_t>(width)));
    const auto a = mean + s * std::sqrt(2.0F) * static_cast<float>(random.normal());
    const auto b = mean + s * std::sqrt(2.0F) * static_cast<float>(random.normal());
    picture.values[i] = Rgb((a + b) / 2);
    picture.half_difference.push_back(Rgb((a - b) / 2));
    // four times the true variance, as within a low-discrepancy set
    picture.sample_variance.push_back(4 * s * s);
  }
  return picture;
}

core::Comparison compared(const Picture& a, const Picture& b) {
  auto result = core::compare_pictures(a, b);
  EXPECT_TRUE(result) << result.error().message;
  return *std::move(result);
}

TEST(Comparison, MetricsMatchTheirFormulas) {
  const auto result = compared(exact(8, 6, {0.5F, 1, 0.25F}), exact(8, 6, {0.25F, 1, 0.75F}));
  EXPECT_DOUBLE_EQ(result.mse, (0.0625 + 0.25) / 3);
  EXPECT_NEAR(result.relmse, (0.0625 / (0.0625 + 0.01) + 0.25 / (0.5625 + 0.01)) / 3, 1e-9);
  EXPECT_DOUBLE_EQ(result.bias, (0.25 - 0.5) / 3);
  EXPECT_EQ(result.bias_low, result.bias);
  EXPECT_EQ(result.difference[5], (Rgb{0.25F, 0, -0.5F}));
}

TEST(Comparison, DifferenceWithoutNoiseIsCertain) {
  const auto result = compared(exact(8, 6, Rgb(0.5F)), exact(8, 6, Rgb(0.51F)));
  EXPECT_EQ(result.z_share_above_3, 1);
  EXPECT_LT(result.z_mean, -3);
  const auto same = compared(exact(8, 6, Rgb(0.5F)), exact(8, 6, Rgb(0.5F)));
  EXPECT_EQ(same.z_share_above_3, 0);
  EXPECT_EQ(same.z[0], 0);
}

TEST(Comparison, HasNoIntervalWithoutAnErrorEstimate) {
  Picture unknown = exact(8, 6, Rgb(0.5F));
  unknown.is_exact = false;
  const auto result = compared(unknown, exact(8, 6, Rgb(0.6F)));
  EXPECT_NEAR(result.bias, -0.1, 1e-6);
  EXPECT_TRUE(std::isnan(result.bias_low));
  EXPECT_TRUE(std::isnan(result.z_variance));
}

/// All pixels of a replicate have the same error, with variance 1 / count: it does not average out
/// over the image.
Picture correlated(std::span<const std::uint32_t> counts, float mean,
                   test_support::Random& random) {
  core::FilmSnapshot film;
  film.rect = {0, 0, 4, 4};
  film.replicates = static_cast<int>(counts.size());
  film.errors = core::PixelErrors::kCorrelated;
  film.pixels.resize(film.pixel_count() * counts.size());
  for (std::size_t k = 0; k < counts.size(); ++k) {
    const float value =
        mean + static_cast<float>(random.normal()) / std::sqrt(static_cast<float>(counts[k]));
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
      film.pixels[i * counts.size() + k] = {value, value, value, 1, 0.5F, counts[k]};
    }
  }
  return core::picture_of(film);
}

struct Misses {
  int with_replicates = 0;
  int as_if_pixels_were_independent = 0;
};

/// Number of a thousand pairs whose interval does not contain 0.
Misses misses(std::span<const std::uint32_t> counts, float bias) {
  test_support::Random random(counts.size());
  Misses out;
  for (int pair = 0; pair < 1000; ++pair) {
    Picture a = correlated(counts, 1 + bias, random);
    Picture b = correlated(counts, 1, random);
    const auto excludes_zero = [&] {
      const auto result = compared(a, b);
      return result.bias_low > 0 || result.bias_high < 0 ? 1 : 0;
    };
    out.with_replicates += excludes_zero();
    a.errors = b.errors = core::PixelErrors::kIndependent;
    out.as_if_pixels_were_independent += excludes_zero();
  }
  return out;
}

TEST(Comparison, ReplicatesEstimateTheErrorOfAMeanOfCorrelatedPixels) {
  // At most 50 of 1000 (Welch's interval is conservative with few replicates), and 4 deviations of
  // such a count.
  for (const std::vector<std::uint32_t>& counts : {std::vector<std::uint32_t>(2, 8),
                                                   std::vector<std::uint32_t>(4, 8),
                                                   std::vector<std::uint32_t>(16, 8),
                                                   {8, 8, 32, 32}}) {
    const Misses found = misses(counts, 0);
    std::printf("    %zu replicates: %d of 1000\n", counts.size(), found.with_replicates);
    EXPECT_LE(found.with_replicates, 50 + 28);
    EXPECT_GT(found.as_if_pixels_were_independent, 250) << "the planted fault: summed squares";
  }
  const std::vector<std::uint32_t> sixteen(16, 8);
  EXPECT_GE(misses(sixteen, 0).with_replicates, 50 - 28);
}

TEST(Comparison, FindsABiasFromReplicates) {
  // Standard error of a - b: sqrt(2 / 128) = 0.125; eight of them.
  const std::vector<std::uint32_t> sixteen(16, 8);
  EXPECT_GE(misses(sixteen, 1).with_replicates, 999);
}

TEST(Comparison, CorrelatedErrorsGiveNoIntervalOfTheBiasWithoutReplicates) {
  const auto level = [](int) { return 0.05F; };
  Picture a = noisy(16, 16, 1, 1, level);
  a.errors = core::PixelErrors::kCorrelated;
  const auto result = compared(a, noisy(16, 16, 1, 2, level));
  EXPECT_TRUE(std::isnan(result.bias_high));
  EXPECT_FALSE(std::isnan(result.z_variance));
}

TEST(Comparison, RefusesDifferentSizes) {
  const auto result = core::compare_pictures(exact(8, 6, {}), exact(6, 8, {}));
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().where, "/b");
}

TEST(Comparison, GaussianNoiseHasTheDistributionOfZ) {
  const auto level = [](int) { return 0.05F; };
  const auto result = compared(noisy(256, 256, 1, 1, level), noisy(256, 256, 1, 2, level));
  // 65,536 pixels; 4 standard deviations of a mean, of a variance and of a count. The
  // transformation of t is accurate to 1%.
  EXPECT_NEAR(result.z_mean, 0, 4.0 / 256);
  EXPECT_NEAR(result.z_variance, 1, 4 * std::sqrt(2.0) / 256 + 0.01);
  EXPECT_NEAR(result.z_share_above_3, 0.0027, 4 * std::sqrt(0.0027) / 256 + 0.0003);
}

TEST(Comparison, NoiseThatEndsAtAnEdgeDoesNotAlarm) {
  // Columns with ten times the noise. If they were pooled without the variance of the samples, 5%
  // would exceed 3.
  const auto level = [](int x) { return x % 16 < 2 ? 0.5F : 0.05F; };
  const auto result = compared(noisy(256, 256, 1, 3, level), noisy(256, 256, 1, 4, level));
  EXPECT_LT(result.z_share_above_3, 0.006);
}

// Of 1,600 intervals 1,520 are expected; 4 standard deviations of sqrt(1600 * 0.95 * 0.05) = 8.72:
// a false alarm in 16,000.
TEST(Comparison, IntervalOfTheBiasCoversInNineteenOfTwenty) {
  const auto level = [](int x) { return 0.01F + 0.002F * static_cast<float>(x); };
  constexpr int kPairs = 1600;
  constexpr double kOff = 4 * 8.72;
  int covered = 0;
  int covered_at_90 = 0;
  for (std::uint64_t i = 0; i < kPairs; ++i) {
    const auto result =
        compared(noisy(24, 16, 1, 2 * i, level), noisy(24, 16, 0.9F, 2 * i + 1, level));
    const double off = std::fabs(result.bias - 0.1);
    const double reach = result.bias_high - result.bias;
    covered += off <= reach ? 1 : 0;
    covered_at_90 += off <= 1.644854 / 1.959964 * reach ? 1 : 0;
  }
  EXPECT_NEAR(covered, 1520, kOff);
  EXPECT_LT(covered_at_90, 1520 - kOff) << "intervals of 90% are detected";
}

core::Image image_of(core::PixelType type, int channels, const std::vector<float>& floats,
                     const std::vector<int>& bytes) {
  core::Image image;
  image.channels = channels;
  image.type = type;
  image.width = 1;
  image.height = 1;
  for (const int value : bytes) {
    image.bytes.push_back(static_cast<std::byte>(value));
  }
  if (!floats.empty()) {
    image.bytes.resize(floats.size() * sizeof(float));
    std::memcpy(image.bytes.data(), floats.data(), image.bytes.size());
  }
  return image;
}

TEST(ComparedPicture, BytesAreSrgb) {
  const auto picture = core::picture_of(image_of(core::PixelType::kU8, 4, {}, {255, 188, 0, 255}));
  ASSERT_TRUE(picture);
  EXPECT_EQ(picture->values[0].r, 1);
  EXPECT_NEAR(picture->values[0].g, 0.50289, 1e-4);  // ((188/255 + 0.055) / 1.055)^2.4
  EXPECT_EQ(picture->values[0].b, 0);
  EXPECT_GT(picture->rounding_variance[0], 0);
}

TEST(ComparedPicture, MultipliesUnassociatedColorsByAlpha) {
  const auto picture = core::picture_of(image_of(core::PixelType::kU8, 2, {}, {255, 51}));
  ASSERT_TRUE(picture);
  EXPECT_FLOAT_EQ(picture->values[0].g, 0.2F);
}

TEST(ComparedPicture, GreyCountsForAllChannels) {
  const auto picture = core::picture_of(image_of(core::PixelType::kF32, 1, {0.3F}, {}));
  ASSERT_TRUE(picture);
  EXPECT_EQ(picture->values[0], Rgb(0.3F));
  EXPECT_EQ(picture->rounding_variance[0], 0);  // not a half float: all digits are significant
}

TEST(ComparedPicture, RecognisesHalfFloatsByTheirRounding) {
  const auto picture = core::picture_of(image_of(core::PixelType::kF32, 3, {1.5F, 1.5F, 1.5F}, {}));
  ASSERT_TRUE(picture);
  const double step = 1.0 / 1024;
  const double weights = 0.2126 * 0.2126 + 0.7152 * 0.7152 + 0.0722 * 0.0722;
  EXPECT_NEAR(picture->rounding_variance[0], step * step / 12 * weights, 1e-12);
}

TEST(ComparedPicture, RefusesNonFiniteValues) {
  const float infinity = std::numeric_limits<float>::infinity();
  const auto picture = core::picture_of(image_of(core::PixelType::kF32, 3, {1, infinity, 1}, {}));
  ASSERT_FALSE(picture);
  EXPECT_EQ(picture.error().code, core::ErrorCode::kInvalidArgument);
}

}  // namespace
