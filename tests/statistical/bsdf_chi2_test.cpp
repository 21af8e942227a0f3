// BSDF samples against their densities. About 500 p-values, each rejected below sidak(0.01, 500) =
// 2.0e-5; seeds are fixed.
#include <gtest/gtest.h>

#include "core/bsdf/bsdf.h"
#include "tests/support/bsdf_cases.h"
#include "tests/support/statistics.h"

namespace {

using core::Bsdf;
using core::Vec3;
using test_support::BsdfCase;
using test_support::Random;

const double kLevel = test_support::sidak(0.01, 500);

double p_value(const Bsdf& bsdf, int samples, float spoil = 1) {
  return test_support::chi2_sphere(
             [&](Random& r) -> std::optional<Vec3> {
               const float lobe = r.uniform();
               const auto s = bsdf.sample(lobe, r.uniform_2d());
               if (!(s.pdf_solid_angle > 0)) {
                 return std::nullopt;  // absorbed, or a delta lobe
               }
               EXPECT_EQ(s.pdf_solid_angle, bsdf.evaluate(s.wi_local).pdf_solid_angle);
               return s.wi_local;
             },
             [&](Vec3 wi) { return spoil * bsdf.evaluate(wi).pdf_solid_angle; }, samples, 7)
      .p_value;
}

class BsdfChi2 : public testing::TestWithParam<BsdfCase> {};

INSTANTIATE_TEST_SUITE_P(Cases, BsdfChi2, testing::ValuesIn(test_support::bsdf_cases()),
                         [](const auto& c) { return c.param.name; });

TEST_P(BsdfChi2, SampleFollowsItsDensity) {
  for (const double degrees : {5.0, 45.0, 78.0}) {
    const Bsdf bsdf = GetParam().seen_from(test_support::direction(degrees));
    EXPECT_GT(p_value(bsdf, 150000), kLevel) << degrees;
  }
}

TEST_P(BsdfChi2, SampleFollowsItsDensityUnderATiltedGeometricNormal) {
  for (const double degrees : {20.0, 60.0}) {
    const Bsdf bsdf =
        GetParam().seen_from(test_support::direction(degrees), test_support::tilted_normal());
    EXPECT_GT(p_value(bsdf, 150000), kLevel) << degrees;
  }
}

// The planted fault, in every fifth case that is no delta: it takes most of the time.
TEST(BsdfChi2Twin, DetectsADensityTwoPercentTooLarge) {
  int looked = 0;
  int cases = 0;
  for (const BsdfCase& each : test_support::bsdf_cases()) {
    const Bsdf bsdf = each.seen_from(test_support::direction(45));
    if (bsdf.prob_delta() <= 0.5F && cases++ % 5 == 0) {
      ++looked;
      EXPECT_LT(p_value(bsdf, 1000000, 1.02F), kLevel) << each.name;
    }
  }
  EXPECT_GE(looked, 10);
}

// The fraction of delta samples equals prob_delta(): |z| < 4.5.
TEST_P(BsdfChi2, SamplesDeltaLobesWithTheStatedProbability) {
  const Bsdf bsdf = GetParam().seen_from(test_support::direction(40));
  Random random(8);
  test_support::Moments delta;
  for (int i = 0; i < 100000; ++i) {
    const float lobe = random.uniform();
    delta.add(bsdf.sample(lobe, random.uniform_2d()).is_delta ? 1 : 0);
  }
  EXPECT_LT(std::abs(delta.z(static_cast<double>(bsdf.prob_delta()))), 4.5) << delta.mean;
}

}  // namespace
