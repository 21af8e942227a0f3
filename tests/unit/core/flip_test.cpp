#include "core/compare/flip.h"

#include <numeric>

#include <gtest/gtest.h>

#include "tests/support/statistics.h"

namespace {

using core::Rgb;
using Picture = std::vector<Rgb>;

constexpr int kWidth = 64;
constexpr int kHeight = 48;

Picture plain(Rgb color) { return Picture(static_cast<std::size_t>(kWidth) * kHeight, color); }

Picture random_picture(std::uint64_t seed) {
  test_support::Random random(seed);
  Picture picture = plain({});
  for (Rgb& c : picture) {
    c = {random.uniform(), random.uniform(), random.uniform()};
  }
  return picture;
}

float at(const std::vector<float>& map, int x, int y) {
  return map[static_cast<std::size_t>(y) * kWidth + static_cast<std::size_t>(x)];
}

double mean(const std::vector<float>& map) {
  return std::accumulate(map.begin(), map.end(), 0.0) / static_cast<double>(map.size());
}

std::vector<float> flip(const Picture& a, const Picture& b) {
  return core::flip_map(a, b, kWidth, kHeight);
}

// Filters preserve constants and features of constants are 0, so two constant images have only the
// colour difference of section 4.1 and 4.3.

TEST(Flip, GreenAndBlueHaveTheMaximumDifference) {
  EXPECT_NEAR(mean(flip(plain({0, 1, 0}), plain({0, 0, 1}))), 1, 1e-5);
}

TEST(Flip, BlackAndWhiteMatchThePaper) {
  // L* from 0 to 100 and no chroma: distance 100^0.7 = 25.119. CIELAB of the sRGB primaries (D65):
  // green (87.735, -86.183, 83.180), blue (32.297, 79.188, -107.860). Hunt: a and b by L / 100.
  // HyAB of the two: 55.438 + hypot(-75.613 - 25.575, 72.978 + 34.835) = 55.438 + 147.861 =
  // 203.299, to the 0.7th: 41.277. Beyond the knee at 0.4 * 41.277 = 16.511: 0.95 + (25.119
  // - 16.511) / (41.277 - 16.511) * 0.05 = 0.96738.
  EXPECT_NEAR(mean(flip(plain({0, 0, 0}), plain({1, 1, 1}))), 0.96738, 2e-4);
}

TEST(Flip, SmallGreyStepIsBelowTheKnee) {
  // L* = 116 cbrt(Y) - 16: 0.2 gives 51.837, 0.22 gives 54.027; distance 2.1903^0.7 = 1.7312.
  // 0.95 / 16.511 * 1.7312 = 0.09961.
  EXPECT_NEAR(mean(flip(plain(Rgb(0.2F)), plain(Rgb(0.22F)))), 0.09961, 2e-4);
}

TEST(Flip, EqualImagesHaveNoDifference) {
  const Picture picture = random_picture(1);
  EXPECT_EQ(mean(flip(picture, picture)), 0);
}

TEST(Flip, IsSymmetricAndBetweenZeroAndOne) {
  const Picture a = random_picture(1);
  const Picture b = random_picture(2);
  const auto map = flip(a, b);
  EXPECT_EQ(map, flip(b, a));
  for (const float value : map) {
    ASSERT_GE(value, 0);
    ASSERT_LE(value, 1);
  }
}

TEST(Flip, ClipsValuesToTheDisplayRange) {
  EXPECT_EQ(mean(flip(plain(Rgb(1)), plain(Rgb(40)))), 0);
  EXPECT_EQ(mean(flip(plain(Rgb(0)), plain(Rgb(-3)))), 0);
}

TEST(Flip, DifferenceOfADotEndsAtTheFilterRadius) {
  // Widest filter: ceil(3 sqrt(0.04 / (2 pi^2)) 67) = 10 pixels; the feature filters reach ceil(1.5
  // * 0.082 * 67) = 9.
  Picture dot = plain(Rgb(0.5F));
  dot[20 * kWidth + 30] = {0.5F, 0.5F, 1};
  const auto map = flip(dot, plain(Rgb(0.5F)));
  EXPECT_GT(at(map, 30, 20), 0);
  EXPECT_GT(at(map, 30, 20), at(map, 33, 20));
  EXPECT_GT(at(map, 40, 20), 0);
  EXPECT_EQ(at(map, 41, 20), 0);
  EXPECT_EQ(at(map, 30, 31), 0);
  EXPECT_NEAR(at(map, 33, 20), at(map, 27, 20), 1e-6);
  EXPECT_NEAR(at(map, 33, 20), at(map, 30, 23), 1e-6);
}

TEST(Flip, FeaturesIncreaseTheDifferenceAlongAnEdge) {
  // Section 4.4: the exponent 1 - feature is 1 far from the edge and less along it.
  Picture edge = plain(Rgb(0.3F));
  for (std::size_t i = 0; i < edge.size(); ++i) {
    edge[i] = i % kWidth < kWidth / 2 ? Rgb(0.3F) : Rgb(0.36F);
  }
  const auto map = flip(edge, plain(Rgb(0.3F)));
  EXPECT_GT(at(map, kWidth / 2 + 1, 20), at(map, kWidth - 1, 20));
  EXPECT_EQ(at(map, 0, 20), 0);
}

TEST(Flip, FineNoiseIsLessVisibleFromFarAway) {
  const Picture flat = plain(Rgb(0.5F));
  Picture noisy = flat;
  test_support::Random random(3);
  for (Rgb& c : noisy) {
    c = Rgb(0.5F + 0.1F * (random.uniform() - 0.5F));
  }
  EXPECT_LT(mean(core::flip_map(noisy, flat, kWidth, kHeight, 134)),
            mean(core::flip_map(noisy, flat, kWidth, kHeight, 33)));
}

}  // namespace
