// The cost of a job from a pilot, whose tiles have known costs.
#include "server/jobs/pilot.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace {

/// A film of a row of tiles, 2 samples per pixel, with these CPU seconds per sample of a pixel.
server::PathCost cost_of(const std::vector<double>& costs) {
  core::FilmSettings settings;
  settings.width = 32 * static_cast<int>(costs.size());
  settings.height = 32;
  settings.albedo = settings.normal = settings.depth = false;
  core::Film film(settings, 2, core::PixelErrors::kIndependent);
  EXPECT_EQ(film.tile_count(), static_cast<int>(costs.size()));
  for (int t = 0; t < film.tile_count(); ++t) {
    core::TileState state = film.tile(t);
    state.samples = 2;
    state.cpu_seconds = costs[static_cast<std::size_t>(t)] * 2 * 32 * 32;
    film.commit(t, std::move(state));
  }
  return server::path_cost(film);
}

// Costs of 9, 10 and 11 have a standard error of 1 / sqrt(3) and two degrees of freedom.
TEST(PathCost, HasStudentsIntervalWidenedByAQuarter) {
  const server::PathCost three = cost_of({9, 10, 11});
  EXPECT_NEAR(three.mean, 10, 1e-9);
  EXPECT_NEAR(three.low, (10 - 4.302653 / std::sqrt(3.0)) / 1.25, 1e-5);
  EXPECT_NEAR(three.high, (10 + 4.302653 / std::sqrt(3.0)) * 1.25, 1e-5);
  // Eight of 9 and eight of 11: a standard error of sqrt(16 / 15 / 16), 15 degrees of freedom.
  std::vector<double> many(16, 9);
  std::fill(many.begin(), many.begin() + 8, 11);
  EXPECT_NEAR(cost_of(many).high, (10 + 2.131450 * std::sqrt(1.0 / 15)) * 1.25, 1e-5);
}

TEST(PathCost, OfFewerThanThreeTilesIsHalfToThreeHalves) {
  for (const std::vector<double>& costs : {std::vector<double>{10}, std::vector<double>{4, 16}}) {
    const server::PathCost cost = cost_of(costs);
    EXPECT_NEAR(cost.low, 5 / 1.25, 1e-9);
    EXPECT_NEAR(cost.high, 15 * 1.25, 1e-9);
  }
}

TEST(PathCost, IsNotNegative) { EXPECT_EQ(cost_of({0.1, 0.1, 20}).low, 0); }

}  // namespace
