// Directions sampled from the Henyey-Greenstein phase function against its density, over cosine and
// azimuth around the direction before (truth 13). Ten p-values, each rejected below sidak(0.001,
// 10).
#include <gtest/gtest.h>

#include "core/media/medium.h"
#include "tests/support/statistics.h"

namespace {

using core::Vec3;
using test_support::Random;

const double kLevel = test_support::sidak(0.001, 10);
constexpr Vec3 kBefore = {0, 0, 1};  // rows of the grid are ranges of the cosine

/// shift: of the mean cosine of the density.
double p_value(float g, float shift) {
  return test_support::chi2_sphere(
             [g](Random& random) -> std::optional<Vec3> {
               return core::sample_henyey_greenstein(kBefore, g, random.uniform_2d());
             },
             [g, shift](Vec3 after) {
               return core::henyey_greenstein(dot(kBefore, after), g + shift);
             },
             /*sample_count=*/700'000, /*seed=*/5, {.rows = 20, .columns = 12})
      .p_value;
}

class HenyeyGreensteinChi2 : public testing::TestWithParam<float> {};

// The mean cosines are those of the truth.
INSTANTIATE_TEST_SUITE_P(MeanCosines, HenyeyGreensteinChi2,
                         testing::Values(-0.9F, -0.5F, 0.0F, 0.5F, 0.9F));

TEST_P(HenyeyGreensteinChi2, SampleFollowsItsDensity) { EXPECT_GT(p_value(GetParam(), 0), kLevel); }

TEST_P(HenyeyGreensteinChi2, DetectsAnotherMeanCosine) {
  EXPECT_LT(p_value(GetParam(), 0.01F), kLevel);
}

}  // namespace
