// Convergence rates of the point sets of each sampler.
#include <cmath>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "core/samplers/dimensions.h"
#include "core/samplers/halton.h"
#include "core/samplers/path_sampler.h"
#include "core/samplers/point_sets.h"
#include "core/settings/choices.h"
#include "core/settings/sample_sets.h"
#include "tests/support/statistics.h"

namespace {

using core::SamplerType;
using core::Vec4;

struct Integrand {
  std::function<double(Vec4)> f;
  double truth = 0;
};
double exp1(float u) { return std::exp(static_cast<double>(u)); }
const double kE = std::exp(1.0) - 1;

const Integrand kLine = {[](Vec4 u) { return exp1(u.x); }, kE};
const Integrand kSmooth2d = {[](Vec4 u) { return exp1(u.x) * exp1(u.y); }, kE* kE};
const Integrand kDisk = {[](Vec4 u) { return u.x * u.x + u.y * u.y < 1 ? 1.0 : 0.0; },
                         0.785398163397448};
/// A sum of functions of one dimension each.
const Integrand kAdditive = {[](Vec4 u) { return exp1(u.x) + exp1(u.y) + exp1(u.z) + exp1(u.w); },
                             4 * kE};
/// A sum of products of two dimensions each, without one-dimensional terms.
const Integrand kPairs = {[](Vec4 u) {
                            const double x[4] = {
                                static_cast<double>(u.x) - 0.5, static_cast<double>(u.y) - 0.5,
                                static_cast<double>(u.z) - 0.5, static_cast<double>(u.w) - 0.5};
                            double sum = 0;
                            for (int a = 0; a < 4; ++a) {
                              for (int b = a + 1; b < 4; ++b) {
                                sum += x[a] * x[b];
                              }
                            }
                            return sum;
                          },
                          0};

/// Point `index` of a set of `size`; (h, h2) identifies the set.
using PointSet =
    std::function<Vec4(std::uint32_t index, std::uint32_t size, std::uint64_t h, std::uint64_t h2)>;

std::uint32_t root(std::uint32_t n) {
  return static_cast<std::uint32_t>(std::lround(std::sqrt(n)));
}

Vec4 stratified(std::uint32_t i, std::uint32_t n, std::uint64_t h, std::uint64_t h2) {
  return core::stratified_4d(i, root(n), core::Pairing::kXyZw, h, h2);
}
Vec4 latin(std::uint32_t i, std::uint32_t n, std::uint64_t h, std::uint64_t h2) {
  return core::latin_hypercube_4d(i, n, h, h2);
}
Vec4 array(std::uint32_t i, std::uint32_t n, std::uint64_t h, std::uint64_t h2) {
  return core::orthogonal_array_4d(i, root(n), h, h2);
}
Vec4 halton(std::uint32_t i, std::uint32_t /*n*/, std::uint64_t h, std::uint64_t h2) {
  return core::halton_4d(core::kCameraGroup, i, h, h2);
}

constexpr int kSets = 300;

double rmse(const PointSet& set, const Integrand& g, std::uint32_t n) {
  double sum = 0;
  for (int r = 0; r < kSets; ++r) {
    const std::uint64_t h = core::mix_bits(static_cast<std::uint64_t>(r) + 1000);
    const std::uint64_t h2 = core::mix_bits(h + 1);
    double mean = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      mean += g.f(set(i, n, h, h2)) / n;
    }
    sum += (mean - g.truth) * (mean - g.truth);
  }
  return std::sqrt(sum / kSets);
}

double slope_of(const PointSet& set, const Integrand& g, const std::vector<std::uint32_t>& sizes) {
  std::vector<double> x;
  std::vector<double> y;
  for (const std::uint32_t n : sizes) {
    x.push_back(std::log(n));
    y.push_back(std::log(rmse(set, g, n)));
  }
  const double s = test_support::slope(x, y);
  std::printf("    slope %.3f\n", s);
  return s;
}

const std::vector<std::uint32_t> kSquares = {16, 36, 64, 144, 256, 576, 1024};
const std::vector<std::uint32_t> kPowers = {16, 32, 64, 128, 256, 512, 1024};
const std::vector<std::uint32_t> kPrimeSquares = {25, 49, 121, 169, 289, 529, 961};

// The logarithm of an rmse from 300 sets has a standard error of 0.041, a slope over these sizes
// one of 0.011; the tolerance is 0.06: false alarm 5e-8 where the rate holds from the first size
// on.
TEST(Slopes, OfStratifiedSamplesIncreaseWithSmoothness) {
  EXPECT_NEAR(slope_of(stratified, kSmooth2d, kSquares), -1.0, 0.06);
  EXPECT_NEAR(slope_of(stratified, kDisk, kSquares), -0.75, 0.06);
  const PointSet alone = [](std::uint32_t i, std::uint32_t n, std::uint64_t h, std::uint64_t h2) {
    return core::stratified_4d(i, root(n), core::Pairing::kYz, h, h2);
  };
  EXPECT_NEAR(slope_of(alone, kLine, kSquares), -1.5, 0.06);
  EXPECT_NEAR(slope_of(stratified, kPairs, kSquares), -0.5, 0.06)
      << "the rate applies to pairs of dimensions only";
}

TEST(Slopes, OfLatinHypercubesDependOnOneDimensionalTerms) {
  EXPECT_NEAR(slope_of(latin, kAdditive, kPowers), -1.5, 0.06);
  EXPECT_NEAR(slope_of(latin, kDisk, kPowers), -0.5, 0.06);
  EXPECT_NEAR(slope_of(latin, kPairs, kPowers), -0.5, 0.06);
}

// Owen 1997: for every integrand, the variance of a Latin hypercube of n points is at most n / (n -
// 1) times that of n independent ones. Tested for an integrand without one-dimensional terms; the
// variance of 2,000 sets has a standard error of 3.2%.
TEST(LatinHypercube, IsAtMostSlightlyWorseThanIndependentPoints) {
  test_support::Moments means;
  constexpr std::uint32_t kSize = 16;
  for (int r = 0; r < 2000; ++r) {
    const std::uint64_t h = core::mix_bits(static_cast<std::uint64_t>(r) + 1);
    double mean = 0;
    for (std::uint32_t i = 0; i < kSize; ++i) {
      mean += kPairs.f(latin(i, kSize, h, core::mix_bits(h))) / kSize;
    }
    means.add(mean);
  }
  const double independent = 6.0 / 144 / kSize;  // six products of variance 1/12 * 1/12
  EXPECT_LT(means.variance() / independent, 16.0 / 15 * 1.13);
}

TEST(Slopes, OfOrthogonalArraysDependOnPairTerms) {
  EXPECT_NEAR(slope_of(array, kPairs, kPrimeSquares), -1.0, 0.06);
  EXPECT_NEAR(slope_of(array, kAdditive, kPrimeSquares), -1.5, 0.06);
}

// Sizes that are powers of two are not blocks of base three: the error is that of the remainder,
// O(1 / n).
TEST(Slopes, OfHaltonAreNearlyMinusOne) {
  EXPECT_NEAR(slope_of(halton, kSmooth2d, kPowers), -1.0, 0.1);
  EXPECT_LT(slope_of(halton, kDisk, kPowers), -0.65);
  EXPECT_NEAR(slope_of(halton, kLine, kPowers), -1.5, 0.06) << "base two";
}

// Sets are independent: beyond one set the error falls as for independent samples, starting from
// the error of one set.
TEST(Slopes, OverSeveralSetsAreMinusOneHalf) {
  for (const auto& entry : core::samplers()) {
    const int size = core::samples_in_set(entry.value);
    if (size == 1) {
      continue;
    }
    core::PathSampler sampler(entry.value, 2, 17);
    std::vector<double> x;
    std::vector<double> y;
    for (int sets = 1; sets <= 32; sets *= 2) {
      double sum = 0;
      for (int r = 0; r < kSets; ++r) {
        double mean = 0;
        for (int i = 0; i < sets * size; ++i) {
          sampler.start(32 * r, 5, 2 * i);
          mean += kSmooth2d.f(sampler.get_4d(core::kCameraGroup)) / (sets * size);
        }
        sum += (mean - kSmooth2d.truth) * (mean - kSmooth2d.truth);
      }
      x.push_back(std::log(sets));
      y.push_back(std::log(std::sqrt(sum / kSets)));
    }
    EXPECT_NEAR(test_support::slope(x, y), -0.5, 0.06) << entry.name;
  }
}

/// Error of the mean over a block of side x side pixels with one set each.
double block_rmse(SamplerType type, int side) {
  core::PathSampler sampler(type, 2, 23);
  const int size = 8;
  double sum = 0;
  for (int r = 0; r < kSets; ++r) {
    double mean = 0;
    for (int pixel = 0; pixel < side * side; ++pixel) {
      for (int i = 0; i < size; ++i) {
        sampler.start(32 * r + pixel % side, pixel / side, 2 * i);
        mean += kSmooth2d.f(sampler.get_4d(core::kCameraGroup)) / (side * side * size);
      }
    }
    sum += (mean - kSmooth2d.truth) * (mean - kSmooth2d.truth);
  }
  return std::sqrt(sum / kSets);
}

// Every block is a net: over n points the error of its mean falls as n^-3/2; independent pixels
// give n^-1/2.
TEST(Slopes, OfPixelBlocksInBlueNoiseOrderAreThoseOfNets) {
  const auto fall = [](SamplerType type) {
    std::vector<double> x;
    std::vector<double> y;
    for (const int side : {1, 2, 4, 8}) {
      x.push_back(std::log(side * side));
      y.push_back(std::log(block_rmse(type, side)));
    }
    return test_support::slope(x, y);
  };
  EXPECT_NEAR(fall(SamplerType::kZsobol), -1.5, 0.12);
  EXPECT_NEAR(fall(SamplerType::kSobol), -0.5, 0.06);
}

}  // namespace
