#include "core/sampling/reservoir.h"

#include <vector>

#include <gtest/gtest.h>

#include "tests/support/statistics.h"

namespace {

using core::WeightedReservoir;
using test_support::Random;

constexpr int kItems = 50;

double weight_of(int i) { return i % 7 == 3 ? 0.0 : 0.1 + (i * 13) % 11; }

/// p-value of the frequency of each of 50 items, with u too large by the factor `stretch`.
double chosen_p(double stretch) {
  constexpr int kDraws = 1000000;
  std::vector<double> observed(kItems, 0.0);
  std::vector<double> expected(kItems, 0.0);
  double total = 0;
  for (int i = 0; i < kItems; ++i) {
    total += weight_of(i);
  }
  for (int i = 0; i < kItems; ++i) {
    expected[static_cast<std::size_t>(i)] = kDraws * weight_of(i) / total;
  }
  Random random(11);
  for (int d = 0; d < kDraws; ++d) {
    WeightedReservoir<int> reservoir(random.uniform_double() * stretch);
    for (int i = 0; i < kItems; ++i) {
      reservoir.add(i, weight_of(i));
    }
    ++observed[static_cast<std::size_t>(reservoir.item())];
  }
  return test_support::chi2(observed, expected).p_value;
}

// 0.1% false alarms, fixed seed.
TEST(WeightedReservoir, SelectsItemsInProportionToTheirWeights) { EXPECT_GT(chosen_p(1), 1e-3); }
TEST(WeightedReservoir, DetectsNumbersThatAreNotUniform) { EXPECT_LT(chosen_p(0.99), 1e-3); }

TEST(WeightedReservoir, ReportsTheSumAndTheWeightOfItsItem) {
  WeightedReservoir<int> reservoir(0.5);
  EXPECT_TRUE(reservoir.empty());
  reservoir.add(1, 0);
  EXPECT_TRUE(reservoir.empty());
  reservoir.add(2, 3);
  reservoir.add(3, 1);
  EXPECT_EQ(reservoir.item(), 2);  // 3 only below 1/4
  EXPECT_EQ(reservoir.weight(), 3);
  EXPECT_EQ(reservoir.sum(), 4);
}

TEST(WeightedReservoir, IsRobustForWeightsOfEveryMagnitude) {
  for (const double u : {0.0, 0.3, 1 - 0x1p-53}) {
    WeightedReservoir<int> reservoir(u);
    reservoir.add(1, 1e-30);
    reservoir.add(2, 1e30);
    reservoir.add(3, 1e-30);
    reservoir.add(4, 0);
    EXPECT_EQ(reservoir.item(), u == 0 ? 3 : 2) << u;  // u = 0 is below every probability
    EXPECT_EQ(reservoir.sum(), 1e30);
  }
}

}  // namespace
