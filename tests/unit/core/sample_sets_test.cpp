// The stratification guaranteed by each sampler, tested through PathSampler as in a render.
#include "core/settings/sample_sets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "core/samplers/dimensions.h"
#include "core/samplers/halton.h"
#include "core/samplers/path_sampler.h"
#include "core/samplers/point_sets.h"
#include "core/samplers/zsobol.h"
#include "core/settings/choices.h"
#include "tests/support/statistics.h"

namespace {

using core::BounceGroup;
using core::PathSampler;
using core::SamplerType;
using Point = std::array<double, 4>;

constexpr int kReplicates = 2;
constexpr int kLight = core::dimension_group(1, BounceGroup::kLight);
constexpr int kBsdf = core::dimension_group(0, BounceGroup::kBsdf);

Point point_of(core::Vec4 v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z),
          static_cast<double>(v.w)};
}

/// Points [first, first + count) of a replicate of a pixel.
std::vector<Point> points(PathSampler& sampler, core::Vec2 pixel, int replicate, int group,
                          int first, int count) {
  std::vector<Point> out;
  for (int i = first; i < first + count; ++i) {
    sampler.start(static_cast<int>(pixel.x), static_cast<int>(pixel.y),
                  i * kReplicates + replicate);
    out.push_back(point_of(sampler.get_4d(group)));
  }
  return out;
}

/// Tests whether each of a x b boxes of dimensions (d0, d1) contains the same number of points.
bool is_even(const std::vector<Point>& set, std::size_t d0, int a, std::size_t d1, int b) {
  std::vector<int> boxes(static_cast<std::size_t>(a * b), 0);
  for (const Point& p : set) {
    ++boxes[static_cast<std::size_t>(p[d0] * a) * static_cast<std::size_t>(b) +
            static_cast<std::size_t>(p[d1] * b)];
  }
  for (const int n : boxes) {
    if (n != static_cast<int>(set.size()) / (a * b)) {
      return false;
    }
  }
  return true;
}
bool is_even(const std::vector<Point>& set, std::size_t d, int a) {
  return is_even(set, d, a, d, 1);
}

/// Applies `check` to every set of several pixels, replicates and groups.
template <typename Check>
void for_sets(SamplerType type, const Check& check) {
  PathSampler sampler(type, kReplicates, 5);
  const int size = core::samples_in_set(type);
  for (int pixel = 0; pixel < 40; ++pixel) {
    for (const int group : {core::kCameraGroup, kLight, kBsdf}) {
      const core::Vec2 at = {static_cast<float>(pixel % 7), static_cast<float>(pixel / 7)};
      check(points(sampler, at, pixel % kReplicates, group, pixel % 3 * size, size), group);
    }
  }
}

TEST(Permutation, IsOneToOneForEveryCount) {
  for (std::uint32_t count = 1; count <= 70; ++count) {
    for (std::uint64_t key = 0; key < 20; ++key) {
      std::set<std::uint32_t> images;
      for (std::uint32_t i = 0; i < count; ++i) {
        images.insert(core::permuted(i, count, key));
      }
      EXPECT_EQ(images.size(), count);
      EXPECT_LT(*images.rbegin(), count);
    }
  }
}

// Any two images of two elements have equal probability. 1% over all nine tests.
TEST(Permutation, ImagesOfTwoElementsAreUniform) {
  for (const std::uint32_t n : {5U, 16U, 25U}) {
    for (const std::uint32_t other : {1U, 2U, n - 1}) {
      std::vector<double> observed(n * n, 0.0);
      std::vector<double> expected(n * n, 0.0);
      const int count = 40 * static_cast<int>(n * (n - 1));
      for (int k = 0; k < count; ++k) {
        const std::uint64_t key = core::mix_bits(static_cast<std::uint64_t>(k) + 1000 * n + other);
        ++observed[core::permuted(0, n, key) * n + core::permuted(other, n, key)];
      }
      for (std::size_t i = 0; i < expected.size(); ++i) {
        expected[i] = i / n == i % n ? 0 : 40;
      }
      EXPECT_GT(test_support::chi2(observed, expected).p_value, test_support::sidak(0.01, 9))
          << n << " " << other;
    }
  }
}

TEST(Strata, AreReproducedExactly) {
  for (const std::uint32_t count : {1U, 3U, 5U, 16U, 25U, 625U, 1U << 20}) {
    for (std::uint32_t k = 0; k < 2000; ++k) {
      const std::uint32_t cell = k % count;
      const std::uint32_t bits = k < count ? 0 : (k < 2 * count ? 0xffffffffU : k * 2654435761U);
      const float u = core::in_stratum(cell, count, bits);
      ASSERT_EQ(static_cast<std::uint32_t>(static_cast<double>(u) * count), cell) << count;
      ASSERT_LT(u, 1);
    }
  }
}

TEST(Stratified, EveryPairHasOnePointInEachCell) {
  for_sets(SamplerType::kStratified, [](const std::vector<Point>& set, int group) {
    if (group == core::kCameraGroup) {
      EXPECT_TRUE(is_even(set, 0, 4, 1, 4));
      EXPECT_TRUE(is_even(set, 2, 4, 3, 4));
    } else {
      EXPECT_TRUE(is_even(set, 1, 4, 2, 4));
      EXPECT_TRUE(is_even(set, 0, 16));
      EXPECT_TRUE(is_even(set, 3, 16));
    }
  });
}

TEST(LatinHypercube, EveryDimensionHasOnePointInEachInterval) {
  for_sets(SamplerType::kLatinHypercube, [](const std::vector<Point>& set, int /*group*/) {
    for (std::size_t d = 0; d < 4; ++d) {
      EXPECT_TRUE(is_even(set, d, 16));
    }
  });
}

TEST(OrthogonalArray, EveryPairHasOnePointInEachCellAndEveryDimensionInEachInterval) {
  for_sets(SamplerType::kOrthogonalArray, [](const std::vector<Point>& set, int /*group*/) {
    for (std::size_t a = 0; a < 4; ++a) {
      EXPECT_TRUE(is_even(set, a, 25));
      for (std::size_t b = a + 1; b < 4; ++b) {
        EXPECT_TRUE(is_even(set, a, 5, b, 5)) << a << b;
      }
    }
  });
}

TEST(OrthogonalArray, IsOneForEveryPrime) {
  for (const std::uint32_t p : {3U, 5U, 7U, 11U, 13U}) {
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      std::vector<Point> set;
      for (std::uint32_t i = 0; i < p * p; ++i) {
        set.push_back(point_of(
            core::orthogonal_array_4d(i, p, core::mix_bits(seed), core::mix_bits(seed + 99))));
      }
      const int levels = static_cast<int>(p);
      for (std::size_t a = 0; a < 4; ++a) {
        EXPECT_TRUE(is_even(set, a, levels * levels));
        for (std::size_t b = a + 1; b < 4; ++b) {
          EXPECT_TRUE(is_even(set, a, levels, b, levels)) << p << a << b;
        }
      }
    }
  }
}

// Continuations of a path: those with the same number form a set; those of one path are not copies
// of each other.
TEST(SampleSets, ContinuationsOfAllPathsFormSets) {
  for (const auto& entry : core::samplers()) {
    PathSampler sampler(entry.value, kReplicates, 5);
    const int size = std::max(core::samples_in_set(entry.value), 16);
    std::vector<Point> all;
    std::vector<Point> second;
    for (int i = 0; i < size; ++i) {
      sampler.start(4, 5, i * kReplicates + 1);
      for (int k = 0; k < 4; ++k) {
        all.push_back(point_of(sampler.branch(k, 4).get_4d(kLight)));
      }
      second.push_back(all[all.size() - 3]);
    }
    for (std::size_t i = 1; i < all.size(); ++i) {
      EXPECT_NE(all[i][1], all[i - 1][1]) << entry.name;
    }
    if (entry.value == SamplerType::kSobol) {
      EXPECT_TRUE(is_even(all, 0, 64)) << "one set of 64";
    }
    if (entry.value == SamplerType::kStratified || entry.value == SamplerType::kLatinHypercube ||
        entry.value == SamplerType::kOrthogonalArray) {
      EXPECT_TRUE(is_even(second, 0, size)) << entry.name;
    }
  }
}

TEST(SampleSets, DetectsAMovedPoint) {
  int seen = 0;
  int sets = 0;
  for_sets(SamplerType::kOrthogonalArray, [&](std::vector<Point> set, int /*group*/) {
    ++sets;
    set[3][1] = set[7][1];
    seen += is_even(set, 1, 25) ? 0 : 1;
  });
  EXPECT_EQ(seen, sets);
  // Not a whole set: 16 points that start in the middle of a set.
  PathSampler sampler(SamplerType::kLatinHypercube, kReplicates, 5);
  EXPECT_FALSE(is_even(points(sampler, {1, 2}, 0, kLight, 8, 16), 0, 16));
}

TEST(Halton, EachBaseHasItsElementaryIntervals) {
  for (const int d : {0, 1, 2, 3, 4, 9, 20}) {
    const std::uint32_t b = core::halton_base(d);
    for (std::uint32_t n = b; n <= 1024; n *= b) {
      for (const std::uint32_t block : {0U, 1U, 17U}) {
        std::vector<Point> set;
        for (std::uint32_t i = block * n; i < (block + 1) * n; ++i) {
          set.push_back({static_cast<double>(
              core::halton_1d(d, i, core::mix_bits(std::uint64_t{block + b})))});
        }
        EXPECT_TRUE(is_even(set, 0, static_cast<int>(n))) << b << " " << n << " " << block;
      }
    }
  }
}

// The remainders of 2^a 3^b consecutive numbers are all different.
TEST(Halton, FilmHasOnePointInEachBoxOfPowersOfTwoAndThree) {
  PathSampler sampler(SamplerType::kHalton, kReplicates, 5);
  for (const auto& [a, b] :
       {std::pair(2, 3), std::pair(4, 9), std::pair(8, 9), std::pair(16, 27), std::pair(32, 9)}) {
    for (const int first : {0, 5, 1000}) {
      EXPECT_TRUE(is_even(points(sampler, {3, 4}, first % 2, core::kCameraGroup, first, a * b), 0,
                          a, 1, b));
    }
  }
  auto mixed = points(sampler, {3, 4}, 0, core::kCameraGroup, 0, 18);
  for (const Point& p : points(sampler, {3, 4}, 1, core::kCameraGroup, 18, 18)) {
    mixed.push_back(p);
  }
  EXPECT_FALSE(is_even(mixed, 0, 4, 1, 9)) << "two replicates do not form one sequence";
}

TEST(Halton, EveryDimensionHasOneBaseOrNone) {
  std::set<int> used;
  int none = 0;
  for (int group = 0; group < core::dimension_group(12, BounceGroup::kLight); ++group) {
    for (int component = 0; component < 4; ++component) {
      const int d = core::halton_dimension(group, component);
      ASSERT_LT(d, core::kHaltonDimensions);
      if (d >= 0) {
        EXPECT_TRUE(used.insert(d).second) << group << " " << component;
      } else {
        ++none;
      }
    }
  }
  EXPECT_EQ(used.size(), static_cast<std::size_t>(core::kHaltonDimensions));
  EXPECT_GT(none, 0);
  EXPECT_EQ(core::halton_base(core::halton_dimension(core::kCameraGroup, 0)), 2U);
  EXPECT_EQ(core::halton_base(core::halton_dimension(core::kCameraGroup, 1)), 3U);
  EXPECT_EQ(core::halton_base(63), 311U) << "the 64th prime";
}

/// Points of the aligned block of side x side pixels at (x, y), which has side^2 sets.
std::vector<Point> block_points(int x, int y, int side, int replicate, int group, int set) {
  PathSampler sampler(SamplerType::kZsobol, kReplicates, 8);
  constexpr int kSize = static_cast<int>(core::kBlueNoiseSize);
  std::vector<Point> all;
  for (int row = y; row < y + side; ++row) {
    for (int column = x; column < x + side; ++column) {
      const core::Vec2 at = {static_cast<float>(column), static_cast<float>(row)};
      for (const Point& p : points(sampler, at, replicate, group, set * kSize, kSize)) {
        all.push_back(p);
      }
    }
  }
  return all;
}

/// In dimensions `first` and `first` + 1.
bool is_net(const std::vector<Point>& set, std::size_t first = 0) {
  const auto n = static_cast<int>(set.size());
  for (int a = 1; a <= n; a *= 2) {
    if (!is_even(set, first, a, first + 1, n / a)) {
      return false;
    }
  }
  return true;
}

TEST(Zsobol, EveryAlignedBlockOfPixelsIsOneNet) {
  for (const int side : {1, 2, 4, 8, 16, 32}) {
    for (int k = 0; k < 4; ++k) {
      const int group = k % 3;
      EXPECT_TRUE(is_net(block_points(side * k, side * (3 - k), side, k % 2, group, k / 2),
                         core::is_of_bsdf(group) ? 1 : 0))
          << side;
    }
  }
  EXPECT_FALSE(is_net(block_points(1, 0, 2, 0, 0, 0))) << "not aligned";
  EXPECT_FALSE(is_net(block_points(31, 0, 2, 0, 0, 0))) << "two tiles";
}

TEST(Zsobol, AllSquareOrdersOccur) {
  const std::set<std::uint8_t> orders(core::kOrdersOfFour.begin(), core::kOrdersOfFour.end());
  EXPECT_EQ(orders.size(), 24U);
  std::set<std::uint32_t> images;
  for (std::uint32_t y = 0; y < 32; ++y) {
    for (std::uint32_t x = 0; x < 32; ++x) {
      images.insert(core::shuffled_zcurve(core::zcurve_index(x, y), 12345));
    }
  }
  EXPECT_EQ(images.size(), 1024U);
  EXPECT_EQ(*images.rbegin(), 1023U);
}

// In closed form: Var((e^u + e^(1-u)) / 2) = .0039125, against .242036 / 2 for two independent
// numbers; a symmetric function has twice the variance.
TEST(Antithetic, LinearFunctionsAreExactAndSymmetricOnesHaveTwiceTheVariance) {
  PathSampler sampler(SamplerType::kAntithetic, kReplicates, 3);
  test_support::Moments exponential;
  test_support::Moments symmetric;
  test_support::Moments directions;
  for (int i = 0; i < 100000; ++i) {
    const core::Vec2 at = {static_cast<float>(i % 300), static_cast<float>(i / 300)};
    for (const int group : {core::kCameraGroup, kLight}) {
      const auto pair = points(sampler, at, i % 2, group, 2 * (i % 5), 2);
      for (std::size_t d = 0; d < 4; ++d) {
        // Numbers have 24 bits: 1 - 2^-24 - u is the mirror image.
        ASSERT_EQ(pair[0][d] + pair[1][d], 1 - 0x1p-24);
      }
      exponential.add((std::exp(pair[0][1]) + std::exp(pair[1][1])) / 2);
      const auto square = [](double u) { return (u - 0.5) * (u - 0.5); };
      symmetric.add((square(pair[0][2]) + square(pair[1][2])) / 2);
    }
    const auto pair = points(sampler, at, i % 2, kBsdf, 0, 2);
    directions.add((pair[0][1] + pair[1][1]) / 2);
  }
  // 200,000 values: the standard error of a variance is 0.4% (its fourth moment is at most 3.5
  // times its square); 4 of that.
  EXPECT_NEAR(exponential.variance() / 0.0039125, 1, 0.016);
  EXPECT_NEAR(symmetric.variance() / (1.0 / 180), 1, 0.016);
  EXPECT_NEAR(directions.variance() / (1.0 / 24), 1, 0.02) << "independent numbers for directions";
}

// 2,000 runs of 64 pairs: 95% have a standard deviation of 0.5%. Treating the numbers of a pair
// as independent gives intervals 5.6 times too wide.
TEST(Antithetic, PairCountsAsOneSample) {
  int covered = 0;
  int naive = 0;
  constexpr int kRuns = 2000;
  const double truth = std::exp(1.0) - 1;
  PathSampler sampler(SamplerType::kAntithetic, kReplicates, 4);
  for (int run = 0; run < kRuns; ++run) {
    test_support::Moments pairs;
    test_support::Moments single;
    for (int i = 0; i < 64; ++i) {
      const auto p = points(sampler, {static_cast<float>(run), 0}, 0, kLight, 2 * i, 2);
      single.add(std::exp(p[0][1]));
      single.add(std::exp(p[1][1]));
      pairs.add((std::exp(p[0][1]) + std::exp(p[1][1])) / 2);
    }
    covered += std::fabs(pairs.mean - truth) < 1.998 * pairs.standard_error() ? 1 : 0;
    naive += std::fabs(single.mean - truth) < 1.979 * single.standard_error() ? 1 : 0;
  }
  EXPECT_NEAR(covered / double{kRuns}, 0.95, 0.02);
  EXPECT_GT(naive / double{kRuns}, 0.99);
}

TEST(SampleCounts, AreRoundedUpToWholeSetsOfEveryReplicate) {
  EXPECT_EQ(core::rounded_samples(SamplerType::kIndependent, 2, 7), 7);
  for (const SamplerType type : {SamplerType::kHalton, SamplerType::kSobol}) {
    EXPECT_EQ(core::rounded_samples(type, 2, 1), 1);
    EXPECT_EQ(core::rounded_samples(type, 2, 7), 8);
  }
  EXPECT_EQ(core::rounded_samples(SamplerType::kAntithetic, 2, 1), 4);
  EXPECT_EQ(core::rounded_samples(SamplerType::kAntithetic, 2, 9), 12);
  EXPECT_EQ(core::rounded_samples(SamplerType::kStratified, 2, 256), 256);
  EXPECT_EQ(core::rounded_samples(SamplerType::kStratified, 2, 257), 288);
  EXPECT_EQ(core::rounded_samples(SamplerType::kLatinHypercube, 4, 100), 128);
  EXPECT_EQ(core::rounded_samples(SamplerType::kOrthogonalArray, 2, 256), 300);
  EXPECT_EQ(core::rounded_samples(SamplerType::kZsobol, 2, 17), 32);
}

// 3 passes of 4 replicates are 12 samples; with sets of 16, whole sets in whole windows are 48 in
// each replicate.
TEST(SampleCounts, AreRoundedUpToWholeWindowsOfLightSampleReuse) {
  core::RenderSettings settings;
  settings.replicates = 4;
  settings.light_history = 3;
  EXPECT_EQ(core::shared_window(settings), 1) << "only restir reuses samples";
  EXPECT_EQ(core::rounded_samples(settings, 1), 1);
  settings.light_sampler = core::LightSamplerType::kRestir;
  EXPECT_EQ(core::shared_window(settings), 12);
  EXPECT_EQ(core::sample_unit(settings), 12);
  EXPECT_EQ(core::rounded_samples(settings, 1), 12);
  EXPECT_EQ(core::rounded_samples(settings, 25), 36);
  settings.sampler = SamplerType::kStratified;
  EXPECT_EQ(core::sample_unit(settings), 192);
  settings.light_history = 1;
  EXPECT_EQ(core::shared_window(settings), 1);
  EXPECT_EQ(core::sample_unit(settings), 64);
}

}  // namespace
