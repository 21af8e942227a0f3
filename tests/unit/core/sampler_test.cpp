#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "core/samplers/dimensions.h"
#include "core/samplers/path_sampler.h"
#include "core/settings/choices.h"
#include "core/settings/sample_sets.h"
#include "tests/support/statistics.h"

namespace {

using core::PathSampler;
using core::SamplerType;
using core::Vec4;

double component(Vec4 v, int i) {
  const float c[4] = {v.x, v.y, v.z, v.w};
  return static_cast<double>(c[i]);
}

std::vector<Vec4> points(std::uint32_t count, std::uint64_t h, std::uint64_t h2) {
  std::vector<Vec4> out;
  for (std::uint32_t i = 0; i < count; ++i) {
    out.push_back(core::sobol_4d(i, h, h2));
  }
  return out;
}

/// Tests whether each box of 2^-a by 2^-b, a + b = k - t, contains exactly 2^t of the 2^k points.
bool is_net(const std::vector<Vec4>& p, int d0, int d1, int t) {
  const int k = static_cast<int>(std::lround(std::log2(static_cast<double>(p.size()))));
  for (int a = 0; a <= k - t; ++a) {
    const int b = k - t - a;
    std::vector<int> boxes(std::size_t{1} << (k - t), 0);
    for (const Vec4& x : p) {
      const auto column = static_cast<std::size_t>(component(x, d0) * (1 << a));
      const auto row = static_cast<std::size_t>(component(x, d1) * (1 << b));
      ++boxes[(row << a) + column];
    }
    for (const int n : boxes) {
      if (n != 1 << t) {
        return false;
      }
    }
  }
  return true;
}

std::uint64_t seed_of(int i) { return core::mix_bits(static_cast<std::uint64_t>(i) + 77); }

TEST(Sobol, FirstTwoDimensionsHaveOnePointInEachElementaryInterval) {
  for (int seed = 0; seed < 8; ++seed) {
    for (std::uint32_t n = 2; n <= 1024; n *= 2) {
      EXPECT_TRUE(is_net(points(n, seed_of(seed), seed_of(seed + 100)), 0, 1, 0)) << n;
    }
  }
}

// The other pairs are nets of a higher t; t of a pair is a property of the direction numbers, and
// scrambling must preserve it. Joe and Kuo's first four dimensions have t <= 3 in every 2-D
// projection.
TEST(Sobol, EveryProjectionIsANetOfSmallT) {
  for (int a = 0; a < 4; ++a) {
    for (int b = a + 1; b < 4; ++b) {
      for (int seed = 0; seed < 8; ++seed) {
        for (std::uint32_t n = 8; n <= 1024; n *= 2) {
          EXPECT_TRUE(is_net(points(n, seed_of(seed), seed_of(seed + 100)), a, b, 3))
              << a << b << " " << n;
        }
      }
    }
  }
}

TEST(Sobol, EveryDimensionIsStratified) {
  for (int d = 0; d < 4; ++d) {
    for (std::uint32_t n = 2; n <= 4096; n *= 2) {
      std::vector<int> strata(n, 0);
      for (const Vec4& p : points(n, seed_of(3), seed_of(4))) {
        ++strata[static_cast<std::size_t>(component(p, d) * n)];
      }
      for (const int count : strata) {
        EXPECT_EQ(count, 1);
      }
    }
  }
}

TEST(Sobol, DetectsANetWithOneMovedPoint) {
  auto p = points(64, seed_of(1), seed_of(2));
  p[5].x = p[6].x;
  EXPECT_FALSE(is_net(p, 0, 1, 0));
}

// A replicate's samples are the points of one set, in order: prefixes of 2^k samples are also nets
// in the image.
TEST(Sobol, SamplesOfAReplicateFormOneSet) {
  PathSampler sampler(SamplerType::kSobol, 2, 9);
  for (const int group : {core::kCameraGroup, core::dimension_group(0, core::BounceGroup::kLight),
                          core::dimension_group(3, core::BounceGroup::kBsdf)}) {
    for (int replicate = 0; replicate < 2; ++replicate) {
      std::vector<Vec4> p;
      for (int s = 0; s < 64; ++s) {
        sampler.start(17, 31, 2 * s + replicate);
        p.push_back(sampler.get_4d(group));
      }
      const int first = core::is_of_bsdf(group) ? 1 : 0;
      EXPECT_TRUE(is_net(p, first, first + 1, 0));
    }
  }
}

TEST(PathSampler, NumbersAreInTheUnitIntervalAndNeverReachOne) {
  for (const auto& entry : core::samplers()) {
    PathSampler sampler(entry.value, 2, 1);
    for (int s = 0; s < 100000; ++s) {
      sampler.start(s % 100, s / 1000, s % 4096);
      const Vec4 u = sampler.get_4d(s % 7);
      for (int d = 0; d < 4; ++d) {
        ASSERT_GE(component(u, d), 0);
        ASSERT_LT(component(u, d), 1);
      }
      const float extra = sampler.extra_1d(s % 5, static_cast<std::uint32_t>(s));
      ASSERT_GE(extra, 0);
      ASSERT_LT(extra, 1);
    }
  }
  EXPECT_LT(core::to_unit_float(0xffffffffU), 1.0F);
}

TEST(PathSampler, NumberDependsOnlyOnItsArguments) {
  for (const auto& entry : core::samplers()) {
    PathSampler a(entry.value, 2, 5);
    PathSampler b(entry.value, 2, 5);
    a.start(1, 2, 3);
    a.get_4d(1);
    a.start(7, 8, 9);
    b.start(7, 8, 9);
    b.get_4d(4);
    const Vec4 x = a.get_4d(2);
    const Vec4 y = b.get_4d(2);
    EXPECT_TRUE(x.x == y.x && x.y == y.y && x.z == y.z && x.w == y.w);
  }
}

/// Correlation of 20,000 pairs of numbers; two of the four arguments identify each pair.
double correlation(SamplerType type,
                   const std::function<std::pair<float, float>(PathSampler&, int)>& pair) {
  constexpr int kPairs = 20000;
  PathSampler sampler(type, 2, 11);
  double xy = 0;
  double xx = 0;
  double yy = 0;
  for (int i = 0; i < kPairs; ++i) {
    const auto [a, b] = pair(sampler, i);
    const double x = static_cast<double>(a) - 0.5;
    const double y = static_cast<double>(b) - 0.5;
    xy += x * y;
    xx += x * x;
    yy += y * y;
  }
  return xy / std::sqrt(xx * yy) * std::sqrt(static_cast<double>(kPairs));  // N(0,1)
}

// |z| < 4.5: false alarm 7e-6 per comparison, 192 comparisons: 0.13%. zsobol correlates its
// neighbours on purpose: for it the pixels are from two tiles.
TEST(PathSampler, NumbersOfAReplicateAreIndependentOfTheOthers) {
  constexpr int kSamples = 200;  // several whole sets of every type
  for (const auto& entry : core::samplers()) {
    PathSampler whole(entry.value, 6, 11);
    for (const auto& [first, count] : {std::pair{0, 2}, std::pair{2, 4}, std::pair{4, 2}}) {
      PathSampler part(entry.value, count, 11, first);
      for (int replicate = first; replicate < first + count; ++replicate) {
        for (int i = 0; i < kSamples; ++i) {
          whole.start(37, 5, 6 * i + replicate);
          part.start(37, 5, count * i + replicate - first);
          const Vec4 expected = whole.get_4d(3);
          const Vec4 found = part.get_4d(3);
          for (int c = 0; c < 4; ++c) {
            ASSERT_EQ(component(found, c), component(expected, c))
                << entry.name << " " << replicate << " " << i;
          }
        }
      }
    }
  }
}

TEST(PathSampler, NeighboursReplicatesGroupsAndSeedsAreUncorrelated) {
  for (const auto& entry : core::samplers()) {
    const SamplerType type = entry.value;
    const int step = type == SamplerType::kZsobol ? 32 : 1;
    for (int d = 0; d < 4; ++d) {
      const auto at = [d](PathSampler& s, int x, int y, int sample, int group) {
        s.start(x, y, sample);
        return static_cast<float>(component(s.get_4d(group), d));
      };
      const auto over = [&](int dx, int dy, int ds, int dg) {
        return correlation(type, [&](PathSampler& s, int i) {
          const int x = i % 200;
          const int y = i / 200;
          return std::pair(at(s, 3 * x, y, 4, 2),
                           at(s, 3 * x + step * dx, y + step * dy, 4 + ds, 2 + dg));
        });
      };
      EXPECT_LT(std::fabs(over(1, 0, 0, 0)), 4.5) << entry.name;
      EXPECT_LT(std::fabs(over(0, 1, 0, 0)), 4.5);
      EXPECT_LT(std::fabs(over(0, 0, 1, 0)), 4.5) << entry.name;  // the other replicate
      EXPECT_LT(std::fabs(over(0, 0, 0, 1)), 4.5) << entry.name;
      EXPECT_LT(std::fabs(over(1, 1, 1, 3)), 4.5);
      PathSampler other(type, 2, 12);
      EXPECT_LT(std::fabs(correlation(type,
                                      [&](PathSampler& s, int i) {
                                        return std::pair(at(s, i % 200, i / 200, 0, 0),
                                                         at(other, i % 200, i / 200, 0, 0));
                                      })),
                4.5);
    }
  }
}

// Sample by sample, the sequences of two pixels must not be correlated.
TEST(PathSampler, TwoPixelsAreUncorrelatedOverTheirSamples) {
  for (int pixel = 0; pixel < 6; ++pixel) {
    const double z = correlation(SamplerType::kSobol, [&](PathSampler& s, int i) {
      s.start(pixel, 0, 2 * i);
      const float a = s.get_4d(1).y;
      s.start(pixel + 1, 0, 2 * i);
      return std::pair(a, s.get_4d(1).y);
    });
    EXPECT_LT(std::fabs(z), 4.5);
  }
}

TEST(PathSampler, DetectsACorrelationOfFivePercent) {
  PathSampler other(SamplerType::kIndependent, 2, 99);
  const double z = correlation(SamplerType::kIndependent, [&](PathSampler& s, int i) {
    s.start(i, 0, 0);
    other.start(i, 1, 0);
    const float a = s.get_4d(0).x;
    return std::pair(a, i % 20 == 0 ? a : other.get_4d(0).x);
  });
  EXPECT_GT(std::fabs(z), 4.5);
}

/// 16 x 16 boxes of two of the four numbers, each pair from a separate pixel (zsobol: from a
/// separate tile), at all positions of a set.
double uniformity(const core::NamedValue<SamplerType>& entry, int d0, int d1, int group,
                  float squeeze) {
  constexpr int kSide = 16;
  constexpr int kCount = 40000;
  const int step = entry.value == SamplerType::kZsobol ? 32 : 1;
  PathSampler sampler(entry.value, 2, 21);
  std::vector<double> observed(kSide * kSide, 0.0);
  const std::vector<double> expected(kSide * kSide, kCount / static_cast<double>(kSide * kSide));
  for (int i = 0; i < kCount; ++i) {
    sampler.start(i % 200 * step, i / 200 * step, i % 128);
    const Vec4 u = sampler.get_4d(group);
    const auto cell = [&](int d) {
      return static_cast<std::size_t>(component(u, d) * static_cast<double>(squeeze) * kSide);
    };
    ++observed[cell(d0) * kSide + cell(d1)];
  }
  return test_support::chi2(observed, expected).p_value;
}

// 8 samplers, 6 pairs of dimensions, 3 groups: 1% over all 144 tests.
TEST(PathSampler, EveryPairOfNumbersIsUniform) {
  const double level = test_support::sidak(0.01, 144);
  for (const auto& entry : core::samplers()) {
    for (const int group : {core::kCameraGroup, core::dimension_group(0, core::BounceGroup::kLight),
                            core::dimension_group(4, core::BounceGroup::kBsdf)}) {
      for (int a = 0; a < 4; ++a) {
        for (int b = a + 1; b < 4; ++b) {
          EXPECT_GT(uniformity(entry, a, b, group, 1), level)
              << entry.name << " " << group << " " << a << b;
        }
      }
    }
    EXPECT_LT(uniformity(entry, 0, 1, 0, 0.98F), level)
        << "two percent too much must be detected: " << entry.name;
  }
}

/// N(0,1) if the errors of two estimates of the integral of e^(x + y) are independent.
double correlation_of_errors(SamplerType type,
                             const std::function<std::pair<int, int>(int)>& pixels, int replicate) {
  PathSampler sampler(type, 2, 31);
  const int n = std::max(8, core::sample_unit(type, 1));
  const auto error = [&](int pixel, int which) {
    double sum = 0;
    for (int i = 0; i < n; ++i) {
      sampler.start(pixel % 1024, pixel / 1024, 2 * i + which);
      const Vec4 u = sampler.get_4d(core::kCameraGroup);
      sum += std::exp(static_cast<double>(u.x + u.y));
    }
    return sum / n - std::pow(std::exp(1.0) - 1, 2);
  };
  constexpr int kPairs = 4000;
  double xy = 0;
  double xx = 0;
  double yy = 0;
  for (int i = 0; i < kPairs; ++i) {
    const auto [a, b] = pixels(i);
    const double x = error(a, 0);
    const double y = error(b, replicate);
    xy += x * y;
    xx += x * x;
    yy += y * y;
  }
  return xy / std::sqrt(xx * yy) * std::sqrt(static_cast<double>(kPairs));
}

// The assumption of error intervals. 16 comparisons: false alarm 0.01%. zsobol shows that
// correlation is detected.
TEST(PathSampler, ErrorsOfReplicatesAndOfPixelsAreIndependent) {
  const auto neighbours = [](int i) { return std::pair(2 * i, 2 * i + 1); };
  for (const auto& entry : core::samplers()) {
    EXPECT_LT(std::fabs(correlation_of_errors(
                  entry.value, [](int i) { return std::pair(i, i); }, 1)),
              4.5)
        << entry.name;
    const double z = correlation_of_errors(entry.value, neighbours, 0);
    if (entry.value == SamplerType::kZsobol) {
      EXPECT_LT(z, -8) << "blue noise: errors of neighbours have opposite signs";
    } else {
      EXPECT_LT(std::fabs(z), 4.5) << entry.name;
    }
  }
}

}  // namespace
