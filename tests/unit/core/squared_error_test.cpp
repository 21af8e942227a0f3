// Bounded squared errors: products of relative differences, and roots of their means.
#include "core/error/squared_error.h"

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "tests/support/statistics.h"

namespace {

using core::ColorSum;

TEST(RelativeProduct, OfGreyErrorsIsTheProductOfTheirShares) {
  const ColorSum x = {1.2, 1.2, 1.2};
  const ColorSum y = {0.9, 0.9, 0.9};
  const ColorSum mu = {1, 1, 1};
  EXPECT_NEAR(core::relative_product(x, mu, y, mu, {2, 2, 2}), 0.1 * -0.05, 1e-12);
}

// An error of the light's colour: (sum of d)^2 / (sum of s)^2.
TEST(RelativeProduct, OfErrorsInTheColourOfTheLightIsTheSquareOfTheirShare) {
  const ColorSum scale = {4, 2, 1};
  const ColorSum x = {4.4, 2.2, 1.1};
  EXPECT_NEAR(core::relative_square(x, scale, scale), 0.01, 1e-12);
}

// By Cauchy's inequality a product of other colours is larger than the share.
TEST(RelativeProduct, OfErrorsOfAnotherColourIsLarger) {
  const ColorSum scale = {1, 1, 1};
  EXPECT_GT(core::relative_square({1.3, 1, 1}, scale, scale), 0.01);
}

TEST(RelativeProduct, OfAFireflyIsBounded) {
  const ColorSum dark = {1, 1, 1};
  const ColorSum firefly = {1e9, 1e9, 1e9};
  EXPECT_NEAR(core::relative_product(dark, firefly, dark, {0.9, 0.9, 0.9}, dark),
              -core::kBound * 0.1, 1e-12);
}

TEST(RelativeProduct, OfBlackIsZero) { EXPECT_EQ(core::relative_product({}, {}, {}, {}, {}), 0); }

constexpr int kSide = 96;
double mean_root(const core::ErrorRoots& roots, double pixels = kSide * kSide) {
  return std::accumulate(roots.tiles.begin(), roots.tiles.end(), 0.0) / pixels;
}

/// The share of the larger of image and truth, in half of the pixels.
double share(double root) { return root / (1 + root / 2); }

template <typename M>
core::SquaredErrors squares_of(const M& m, int side = kSide) {
  core::SquaredErrors out({8, 16, side, side});
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      out.set(x, y, m(x, y), {1, 0}, true);
    }
  }
  return out;
}

TEST(SquaredErrors, OfAnEvenErrorHaveItsRoot) {
  const core::ErrorRoots roots = squares_of([](int, int) { return 0.04; }).roots();
  EXPECT_NEAR(mean_root(roots), share(0.2), 1e-9);
  EXPECT_NEAR(roots.deviation, 0, 1e-9);
}

// Half of the windows have an error of 20%, half none.
TEST(SquaredErrors, KeepDifferencesBetweenWindows) {
  const core::ErrorRoots roots =
      squares_of([](int x, int) { return x < kSide / 2 ? 0.04 : 0.0; }).roots();
  EXPECT_NEAR(mean_root(roots), share(0.2) / 2, 1e-3);
}

// A quarter of the pixels of each window is 80% off, a root mean square of 40%, and the others are
// right: their mean is share(0.8) / 4. The errors are seen through d.
TEST(SquaredErrors, OnFewPixelsCountOnThese) {
  core::SquaredErrors squares({0, 0, 16, 16});
  core::SquaredErrors blind({0, 0, 16, 16});
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 16; ++x) {
      const double square = x % 4 == 0 ? 0.64 : 0;
      squares.set(x, y, 0.16, {square, 0}, true);
      blind.set(x, y, 0.16, {0.16, 0}, true);
    }
  }
  EXPECT_NEAR(mean_root(squares.roots(), 256), share(0.8) / 4, 1e-9);
  EXPECT_NEAR(squares.error({0, 0, 8, 8}), share(0.8) / 4, 1e-9);
  EXPECT_NEAR(blind.error({0, 0, 8, 8}), share(0.4), 1e-9) << "an even d";
}

// The same difference and an even one, both of the mean square 0.16: k^2 is 1/4 and 1, 5/8 in the
// mean. Differences that vanish count for nothing.
TEST(SquaredErrors, OfTwoDifferencesCountBySquares) {
  core::SquaredErrors both({0, 0, 8, 8});
  core::SquaredErrors noise({0, 0, 8, 8});
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) {
      const double square = x % 4 == 0 ? 0.64 : 0;
      both.set(x, y, 0.16, {square, 0.16}, true);
      noise.set(x, y, 0.16, {1e-6 * square, 0.16}, true);
    }
  }
  const double k = std::sqrt(0.625);
  EXPECT_NEAR(both.error({0, 0, 8, 8}), k * k * share(0.4 / k), 1e-9);
  EXPECT_NEAR(noise.error({0, 0, 8, 8}), share(0.4), 1e-5);
}

TEST(SquaredErrors, LeaveOutPixelsThatDoNotCount) {
  core::SquaredErrors squares({0, 0, 8, 8});
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) {
      squares.set(x, y, x < 4 ? 0.09 : 7, {1, 0}, x < 4);
    }
  }
  EXPECT_NEAR(squares.error({0, 0, 8, 8}), share(0.3), 1e-9);
  EXPECT_NEAR(mean_root(squares.roots(), 32), share(0.3), 1e-9);
}

// m with the mean 0.0025 and a standard deviation of 0.1, that of its windows 0.1 / 8. The root of
// each window alone is E sqrt(max(0, N(0.0025, 0.0125))) = 0.056.
TEST(SquaredErrors, AreNotRaisedByNoise) {
  test_support::Moments roots;
  test_support::Moments raw;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    test_support::Random random(seed);
    const core::SquaredErrors squares =
        squares_of([&](int, int) { return 0.0025 + 0.1 * random.normal(); });
    roots.add(mean_root(squares.roots()));
    double alone = 0;
    for (int y = 0; y < kSide; y += core::kEnergyWindow) {
      for (int x = 0; x < kSide; x += core::kEnergyWindow) {
        alone += squares.error({x, y, core::kEnergyWindow, core::kEnergyWindow}) / 144;
      }
    }
    raw.add(alone);
  }
  EXPECT_NEAR(roots.mean, share(0.05), 0.006);
  EXPECT_GT(raw.mean, roots.mean + 0.003) << "what drawing the windows together avoids";
}

// m = 0.04 and noise of 0.04 in a pixel, 0.005 in a window: its root has a standard error of
// 0.005 / (2 sqrt(0.04)), the mean of 144 a twelfth. d share(R) / d R = 1 / (1 + R / 2)^2.
TEST(SquaredErrors, HaveTheStandardErrorOfTheirNoise) {
  const auto deviation = [](double far_m) {
    test_support::Moments out;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      test_support::Random random(seed);
      out.add(squares_of([&](int x, int) {
                return (x < kSide / 2 ? 0.04 : far_m) + 0.04 * random.normal();
              })
                  .roots()
                  .deviation);
    }
    return out.mean;
  };
  const double expected = 0.0125 / 12 / (1.1 * 1.1);
  EXPECT_NEAR(deviation(0.04), expected, 0.1 * expected);
  // Structure is not noise: windows with an error of 60% know it better.
  EXPECT_LT(deviation(0.36), expected);
}

}  // namespace
