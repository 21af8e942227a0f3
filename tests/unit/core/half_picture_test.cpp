// Variance estimates of a half of an image with splatted particles.
#include <cmath>

#include <gtest/gtest.h>

#include "core/denoise/denoiser.h"
#include "tests/support/statistics.h"

namespace {

using core::FilmSnapshot;
using test_support::Random;

constexpr int kSide = 64;
constexpr int kSamples = 16;             ///< of a half
constexpr double kSplatVariance = 0.01;  ///< relative to the squared signal
constexpr double kEdgeVariance = 0.25;   ///< of a sample, relative to the squared signal
constexpr double kVarianceBeside = 0.0001;

double light_at(int x) { return 0.5 + 0.5 * x / kSide; }
bool is_edge(int x) { return x == 10 || x == 11; }

/// Camera paths have variance only at an edge. Splats add noise everywhere.
FilmSnapshot splatted() {
  FilmSnapshot film;
  film.rect = {0, 0, kSide, kSide};
  film.has_splats = true;
  Random random(1);
  for (int i = 0; i < kSide * kSide * 2; ++i) {
    const int x = i / 2 % kSide;
    const double mu = light_at(x);
    const double deviation = mu * std::sqrt(is_edge(x) ? kEdgeVariance : kVarianceBeside);
    test_support::Moments moments;
    for (int s = 0; s < kSamples; ++s) {
      moments.add(mu + deviation * random.normal());
    }
    const auto v =
        static_cast<float>(moments.mean + std::sqrt(kSplatVariance * mu) * random.normal());
    film.pixels.push_back({v, v, v, 1, static_cast<float>(moments.m2), kSamples});
  }
  return film;
}

/// Camera paths only. Half A has a sample variance of kEdgeVariance on the left and kVarianceBeside
/// on the right, half B the other way round.
FilmSnapshot lopsided() {
  FilmSnapshot film;
  film.rect = {0, 0, kSide, kSide};
  Random random(2);
  for (int i = 0; i < kSide * kSide * 2; ++i) {
    const bool is_left = i / 2 % kSide < kSide / 2;
    const double variance = is_left == (i % 2 == 0) ? kEdgeVariance : kVarianceBeside;
    test_support::Moments moments;
    for (int s = 0; s < kSamples; ++s) {
      moments.add(1 + std::sqrt(variance) * random.normal());
    }
    const auto v = static_cast<float>(moments.mean);
    film.pixels.push_back({v, v, v, 1, static_cast<float>(moments.m2), kSamples});
  }
  return film;
}

/// Mean over a column of the variance of the half's mean, per channel.
double variance_at(const FilmSnapshot& film, int x, int of_half = 0) {
  const core::HalfPicture half = core::half_picture(film, of_half);
  double sum = 0;
  for (int y = 0; y < kSide; ++y) {
    sum += static_cast<double>(half.variance[static_cast<std::size_t>(y * kSide + x)]);
  }
  return sum / kSide / 3;
}

TEST(HalfPicture, SplatsHaveTheVarianceOfCountsAndEdgesThatOfSamples) {
  FilmSnapshot film = splatted();
  const double beside = variance_at(film, 40) / (kSplatVariance * light_at(40));
  EXPECT_GT(beside, 0.5);
  EXPECT_LT(beside, 2);
  const double of_edge = kEdgeVariance / kSamples * light_at(10) * light_at(10);
  EXPECT_GT(variance_at(film, 10) / of_edge, 0.5);
  EXPECT_LT(variance_at(film, 10) / of_edge, 2);
  film.has_splats = false;  // planted fault: treats the noise of splats as that of camera paths
  EXPECT_GT(variance_at(film, 10) / of_edge, 10);
}

// A pixel's own 15 degrees of freedom and 64 rows: the means differ from the variances by 4%; the
// scale, from the smoothest quarter of the blocks, by less than a factor of two.
TEST(HalfPicture, EachHalfHasItsOwnVariance) {
  const FilmSnapshot film = lopsided();
  for (const int half : {0, 1}) {
    for (const bool is_left : {true, false}) {
      const double expected = (is_left == (half == 0) ? kEdgeVariance : kVarianceBeside) / kSamples;
      const double seen = variance_at(film, is_left ? 12 : 52, half);
      EXPECT_GT(seen, expected / 2) << half << is_left;
      EXPECT_LT(seen, expected * 2) << half << is_left;
    }
  }
}

}  // namespace
