// Chi-squared tests of this file: 18 p-values, each rejected below sidak(0.01, 18) = 0.00056; seeds
// are fixed.
#include "core/sampling/distribution.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/statistics.h"
#include "core/math/numbers.h"
#include "core/sampling/mis.h"
#include "core/sampling/warp.h"
#include "tests/support/statistics.h"

namespace {

using core::Distribution1D;
using core::Distribution2D;
using core::Vec2;
using core::Vec3;
using test_support::Random;

constexpr double kLevel = 0.00056;
constexpr int kSamples = 200000;

double chi2_1d(const std::vector<float>& weights, double spoil) {
  const Distribution1D d(weights);
  Random random(1);
  const std::size_t cells = weights.size() * 3;
  std::vector<double> observed(cells, 0.0);
  std::vector<double> expected(cells, 0.0);
  for (int i = 0; i < kSamples; ++i) {
    const auto s = d.sample(random.uniform());
    EXPECT_EQ(s.pdf_unit, d.pdf_unit(s.x));
    ++observed[static_cast<std::size_t>(s.x * static_cast<float>(cells))];
  }
  for (std::size_t c = 0; c < cells; ++c) {
    const float x = (static_cast<float>(c) + 0.5F) / static_cast<float>(cells);
    expected[c] = kSamples * static_cast<double>(d.pdf_unit(x)) / static_cast<double>(cells);
  }
  expected[0] *= spoil;
  return test_support::chi2(observed, expected).p_value;
}

TEST(Distribution1DChi2, SamplesFollowTheDensity) {
  EXPECT_GT(chi2_1d({1, 2, 3, 4, 5, 6, 7}, 1), kLevel);
  EXPECT_GT(chi2_1d({0, 0, 5, 0, 1, 0}, 1), kLevel);
  EXPECT_GT(chi2_1d({3}, 1), kLevel);
  EXPECT_GT(chi2_1d({1e-6F, 1e6F, 1, 0}, 1), kLevel);
  EXPECT_GT(chi2_1d({0, 0, 0}, 1), kLevel) << "all zero: uniform";
}

TEST(Distribution1DChi2, DetectsACellTenPercentTooHeavy) {
  EXPECT_LT(chi2_1d({1, 1, 1, 1}, 1.1), kLevel);
}

TEST(Distribution1D, NeverSamplesACellOfZeroWeight) {
  const Distribution1D d({0, 1, 0, 0, 2, 0});
  for (int i = 0; i < 1 << 12; ++i) {
    const auto s = d.sample(static_cast<float>(i) / (1 << 12));
    EXPECT_TRUE(s.cell == 1 || s.cell == 4);
    EXPECT_GT(s.pdf_unit, 0);
    EXPECT_LT(s.x, 1);
  }
  EXPECT_EQ(d.sample(0x1.fffffep-1F).cell, 4);
}

/// The last cell that begins at or before u, without a guide.
int plain_cell(const core::DistributionTable& table, float u) {
  int cell = 0;
  for (int i = 1; i < table.size; ++i) {
    cell = table.cdf[i] <= u ? i : cell;
  }
  return cell;
}

// Rows of a sky with a sun: long runs of zeros, and most of the weight in one cell. Numbers at the
// edges of cells and of guides are among those tried.
TEST(Distribution2D, GuidesOfAnyWidthLeadToTheCell) {
  Random random(3);
  for (const int width : {1, 2, 7, 8, 9, 63, 1000}) {
    std::vector<float> weights;
    for (int i = 0; i < 3 * width; ++i) {
      weights.push_back(random.uniform() < 0.7F ? 0 : random.uniform());
    }
    weights[static_cast<std::size_t>(width / 2)] = 50;
    weights[static_cast<std::size_t>(2 * width)] = 1;
    const Distribution2D d(weights, width, 3);
    for (std::size_t row = 0; row < 3; ++row) {
      const core::DistributionTable table = d.row(row);
      std::vector<float> tried(400);
      for (float& u : tried) {
        u = random.uniform();
      }
      tried.insert(tried.end(), table.cdf, table.cdf + width);
      for (int i = 0; i < table.guide_size; ++i) {
        const float edge = static_cast<float>(i) / static_cast<float>(table.guide_size);
        tried.insert(tried.end(), {edge, std::nextafter(edge, 0.0F), std::nextafter(edge, 1.0F)});
      }
      for (const float number : tried) {
        const float u = std::min(number, core::kOneMinusEpsilon);
        const int cell = plain_cell(table, u);
        EXPECT_EQ(table.cell_of(u), cell) << width << ", " << u;
        EXPECT_EQ(table.cell_of(core::Floats<8>(u)).v[3], cell) << width << ", " << u;
      }
    }
  }
}

TEST(Distribution1D, CellsSumToOne) {
  const Distribution1D d({0.1F, 7, 3.3F, 0, 12});
  double sum = 0;
  for (std::size_t c = 0; c < d.size(); ++c) {
    sum += static_cast<double>(d.prob_cell(c));
  }
  EXPECT_NEAR(sum, 1, 1e-6);
}

double chi2_2d(const std::vector<float>& weights, int width, int height) {
  const Distribution2D d(weights, width, height);
  Random random(2);
  const int columns = 2 * width;
  const int rows = 2 * height;
  std::vector<double> observed(static_cast<std::size_t>(columns * rows), 0.0);
  std::vector<double> expected(observed.size(), 0.0);
  for (int i = 0; i < kSamples; ++i) {
    const auto s = d.sample(random.uniform_2d());
    EXPECT_NEAR(s.pdf_unit, d.pdf_unit(s.uv), 1e-5F * s.pdf_unit);
    const auto x = static_cast<std::size_t>(s.uv.x * static_cast<float>(columns));
    const auto y = static_cast<std::size_t>(s.uv.y * static_cast<float>(rows));
    ++observed[y * static_cast<std::size_t>(columns) + x];
  }
  for (std::size_t c = 0; c < expected.size(); ++c) {
    const auto x = static_cast<float>(c % static_cast<std::size_t>(columns));
    const auto y = static_cast<float>(c / static_cast<std::size_t>(columns));
    expected[c] = kSamples *
                  static_cast<double>(d.pdf_unit({(x + 0.5F) / static_cast<float>(columns),
                                                  (y + 0.5F) / static_cast<float>(rows)})) /
                  (columns * rows);
  }
  return test_support::chi2(observed, expected).p_value;
}

TEST(Distribution2DChi2, SamplesFollowTheDensity) {
  EXPECT_GT(chi2_2d({1, 2, 3, 4, 5, 6}, 3, 2), kLevel);
  EXPECT_GT(chi2_2d({0, 0, 0, 0, 9, 0, 1, 0, 0, 0, 0, 2}, 4, 3), kLevel);
  std::vector<float> spike(32 * 16, 0.01F);
  spike[5 * 32 + 7] = 1000;
  EXPECT_GT(chi2_2d(spike, 32, 16), kLevel);
}

double chi2_warp(const std::function<Vec3(Vec2)>& warp,
                 const std::function<float(Vec3)>& pdf_solid_angle, int count = kSamples) {
  return test_support::chi2_sphere(
             [&](Random& r) { return std::optional<Vec3>(warp(r.uniform_2d())); }, pdf_solid_angle,
             count, 3)
      .p_value;
}

TEST(WarpChi2, SamplesFollowTheirDensities) {
  EXPECT_GT(chi2_warp(core::cosine_hemisphere<core::Vec2>,
                      [](Vec3 w) { return core::cosine_hemisphere_pdf_solid_angle(w.z); }),
            kLevel);
  EXPECT_GT(chi2_warp(core::uniform_hemisphere<core::Vec2>,
                      [](Vec3 w) { return w.z > 0 ? 0.5F * core::kInvPi : 0.0F; }),
            kLevel);
  EXPECT_GT(chi2_warp(core::uniform_sphere<Vec2>, [](Vec3) { return 0.25F * core::kInvPi; }),
            kLevel);
}

TEST(WarpChi2, DetectsADensityTwoPercentTooLarge) {
  EXPECT_LT(
      chi2_warp(
          core::cosine_hemisphere<core::Vec2>,
          [](Vec3 w) { return 1.02F * core::cosine_hemisphere_pdf_solid_angle(w.z); }, 500000),
      kLevel);
}

TEST(WarpChi2, DetectsCosineInsteadOfUniformSampling) {
  EXPECT_LT(chi2_warp(core::cosine_hemisphere<core::Vec2>,
                      [](Vec3 w) { return w.z > 0 ? 0.5F * core::kInvPi : 0.0F; }),
            kLevel);
}

TEST(WarpChi2, DiskIsUniform) {
  Random random(4);
  std::vector<double> observed(15 * 16, 0.0);
  for (int i = 0; i < kSamples; ++i) {
    const Vec2 p = core::concentric_disk(random.uniform_2d());
    const double r2 = static_cast<double>(p.x * p.x + p.y * p.y);
    const double phi =
        std::atan2(static_cast<double>(p.y), static_cast<double>(p.x)) / 6.2831853 + 0.5;
    ASSERT_LE(r2, 1.000001);
    ++observed[std::min<std::size_t>(static_cast<std::size_t>(r2 * 15), 14) * 16 +
               std::min<std::size_t>(static_cast<std::size_t>(phi * 16), 15)];
  }
  const std::vector<double> expected(15 * 16, kSamples / 240.0);
  EXPECT_GT(test_support::chi2(observed, expected).p_value, kLevel);
}

TEST(WarpChi2, TriangleIsUniform) {
  Random random(5);
  // Counts in the cells of the parallelogram: those below the diagonal whole, those on it half.
  constexpr int kSide = 12;
  std::vector<double> observed(kSide * kSide, 0.0);
  std::vector<double> expected(kSide * kSide, 0.0);
  for (int i = 0; i < kSamples; ++i) {
    const Vec2 b = core::uniform_triangle(random.uniform_2d());
    ASSERT_GE(b.x, 0);
    ASSERT_GE(b.y, 0);
    ASSERT_LE(b.x + b.y, 1.000001F);
    ++observed[std::min<std::size_t>(static_cast<std::size_t>(b.y * kSide), kSide - 1) * kSide +
               std::min<std::size_t>(static_cast<std::size_t>(b.x * kSide), kSide - 1)];
  }
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const double share = x + y < kSide - 1 ? 1.0 : (x + y == kSide - 1 ? 0.5 : 0.0);
      expected[static_cast<std::size_t>(y * kSide + x)] = share * kSamples * 2 / (kSide * kSide);
    }
  }
  for (std::size_t c = 0; c < observed.size(); ++c) {  // rounding on the diagonal
    if (expected[c] == 0 && observed[c] < 3) {
      observed[c] = 0;
    }
  }
  EXPECT_GT(test_support::chi2(observed, expected).p_value, kLevel);
}

TEST(Mis, WeightsOfBothTechniquesSumToOne) {
  Random random(6);
  for (const core::MisRule rule :
       {core::MisRule{core::MisType::kBalance, 1}, core::MisRule{core::MisType::kPower, 2},
        core::MisRule{core::MisType::kPower, 1}, core::MisRule{core::MisType::kPower, 4},
        core::MisRule{core::MisType::kPower, 0.5F}, core::MisRule{core::MisType::kMaximum, 2}}) {
    for (int i = 0; i < 1000; ++i) {
      const float a = std::exp(static_cast<float>(10 * random.normal()));
      const float b = std::exp(static_cast<float>(10 * random.normal()));
      EXPECT_NEAR(rule.weight(a, b) + rule.weight(b, a), 1, 1e-6);
      EXPECT_EQ(rule.weight(a, 0), 1);
    }
    EXPECT_NEAR(rule.weight(3, 3), 0.5, 1e-7);
    EXPECT_FALSE(std::isnan(rule.weight(1e-38F, 3e38F)));
    EXPECT_FALSE(std::isnan(rule.weight(3e38F, 1e-38F)));
  }
}

TEST(Statistics, QuantilesMatchTheTables) {
  EXPECT_NEAR(core::normal_quantile(0.975), 1.959964, 1e-6);
  EXPECT_NEAR(core::chi2_quantile(0.95, 1), 3.841459, 1e-5);
  EXPECT_NEAR(core::chi2_quantile(0.05, 10), 3.940299, 1e-5);
  EXPECT_NEAR(core::chi2_quantile(0.95, 100), 124.3421, 0.01);  // Wilson and Hilferty
  EXPECT_NEAR(core::chi2_cdf(18.30704, 10), 0.95, 1e-6);
  EXPECT_NEAR(core::student_t_quantile(0.975, 1), 12.7062, 1e-3);
  EXPECT_NEAR(core::student_t_quantile(0.975, 15), 2.13145, 1e-4);
  EXPECT_NEAR(core::f_quantile(0.95, 10), 2.97824, 1e-4);
  EXPECT_NEAR(core::f_quantile(0.975, 4), 9.60453, 1e-4);
  EXPECT_NEAR(core::f_quantile(0.025, 4), 1 / 9.60453, 1e-6);
  EXPECT_NEAR(core::f_quantile(0.95, 60), 1.53431, 1e-3);  // Paulson
  EXPECT_NEAR(core::f_quantile(0.05, 60), 1 / 1.53431, 1e-3);
}

TEST(Statistics, QuantilesMatchTheClosedForms) {
  for (const double p : {1e-9, 1e-4, 0.025, 0.4, 0.6, 0.75, 0.95, 0.975, 0.9999}) {
    const double one = -1 / std::tan(std::numbers::pi * p);
    EXPECT_NEAR(core::student_t_quantile(p, 1), one, 2e-12 * std::fabs(one)) << p;
    const double two = (2 * p - 1) / std::sqrt(2 * p * (1 - p));
    EXPECT_NEAR(core::student_t_quantile(p, 2), two, 1e-13 * std::fabs(two)) << p;
    const double chi2 = -2 * std::log1p(-p);
    EXPECT_NEAR(core::chi2_quantile(p, 2), chi2, 1e-10 * chi2) << p;
    const double f = p / (1 - p);
    EXPECT_NEAR(core::f_quantile(p, 2), f, 1e-10 * f) << p;
    EXPECT_NEAR(0.5 * std::erfc(-core::normal_quantile(p) / std::sqrt(2.0)), p, 1e-12 * p) << p;
  }
  EXPECT_EQ(core::student_t_quantile(0.5, 3), 0);
  EXPECT_EQ(core::normal_quantile(0.5), 0);
}

}  // namespace
