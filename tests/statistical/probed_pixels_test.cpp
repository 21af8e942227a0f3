// Error estimates that know a pixel's expected value from samples of its own, in films made of known distributions.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "core/film/error_estimate.h"
#include "tests/support/statistics.h"

namespace {

using core::ErrorEstimate;
using core::FilmSnapshot;

constexpr int kSide = 64;
constexpr std::uint32_t kBright = 2080;
constexpr double kNoise = 0.003;  ///< of a half of a pixel of the wall, whose radiance is 0.3

/// A wall with little noise, Gaussian, half by half.
FilmSnapshot wall(std::uint64_t seed) {
  FilmSnapshot film;
  film.rect = {0, 0, kSide, kSide};
  test_support::Random random(seed);
  for (int i = 0; i < 2 * kSide * kSide; ++i) {
    const auto v = static_cast<float>(0.3 + kNoise * random.normal());
    film.pixels.push_back({v, v, v, 1, static_cast<float>(kNoise * kNoise * 127 * 128), 128});
  }
  return film;
}

/// The same, where in one pixel 7 of one half's 128 samples found something far brighter, and none of the other's.
FilmSnapshot wall_with_one_bright_half(std::uint64_t seed) {
  FilmSnapshot film = wall(seed);
  const auto m2 = static_cast<float>(6.0 * 6.0 * 128 * (128.0 / 7 - 1));
  film.pixels[std::size_t{kBright} * 2] = {6.3F, 6.3F, 6.3F, 1, m2, 128};
  film.pixels[std::size_t{kBright} * 2 + 1] = {0.3F, 0.3F, 0.3F, 1, 0, 128};
  return film;
}

/// What most() says over what the picture is off by, whose bright pixel in truth is `mu`.
double most_over_truth(const FilmSnapshot& film, std::span<const core::ProbedPixel> probed, double mu) {
  const double off = 0.5 * (6.3 + 0.3) - mu;
  const double others = (kSide * kSide - 1) * kNoise * kNoise / 2 / (0.3 * 0.3 + 0.01);
  const double truth = std::sqrt((off * off / (mu * mu + 0.01) + others) / (kSide * kSide));
  return ErrorEstimate(film, {}, probed).most(0.05) / truth;
}

// What is the rim of something bright, and what a firefly, the film cannot know, and a probe tells.
TEST(ProbedPixels, TellARimFromAFirefly) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const FilmSnapshot film = wall_with_one_bright_half(seed);
    ASSERT_EQ(ErrorEstimate(film).doubtful(), std::vector<std::uint32_t>{kBright});
    for (const double mu : {0.3, 2.8, 4.0}) {
      const core::Rgb value(static_cast<float>(mu));
      const std::vector<core::ProbedPixel> exact = {{kBright, {value, value}}};
      EXPECT_NEAR(most_over_truth(film, exact, mu), 1, 0.05) << mu;
      // Probes that differ by a fifth tell less.
      const std::vector<core::ProbedPixel> noisy = {{kBright, {value * 1.1F, value * 0.9F}}};
      EXPECT_GT(most_over_truth(film, noisy, mu), 1.01) << mu;
    }
    // The twin: unprobed, all three say the same, and what is off by 30 is told from what is off by 0.2 by none.
    EXPECT_TRUE(std::abs(std::log(most_over_truth(film, {}, 4.0))) > std::log(1.5) ||
                std::abs(std::log(most_over_truth(film, {}, 0.3))) > std::log(1.5));
  }
}

// Noise that is alike everywhere leaves no pixel in doubt.
TEST(ProbedPixels, AreNoneOfManyAlike) { EXPECT_TRUE(ErrorEstimate(wall(1)).doubtful().empty()); }

// A probe that agrees with what was expected is of one pixel of many alike: ErrorTarget.IsKeptWithCaustics fails where those count.
TEST(ProbedPixels, SurpriseWhereTheyContradict) {
  const FilmSnapshot film = wall_with_one_bright_half(5);
  const ErrorEstimate estimate(film);
  const core::Rgb expected = core::expected_values(film)[kBright].mean;
  const auto surprises = [&](double mu) {
    const core::Rgb value(static_cast<float>(mu));
    return estimate.surprises({{kBright, {value * 1.1F, value * 0.9F}}});
  };
  const auto was = static_cast<double>(core::luminance(expected));
  EXPECT_TRUE(surprises(was).empty());
  for (const double factor : {1.9, 2.1}) {
    // Of mu^2 + 0.01, what errors are divided by.
    for (const double square : {(was * was + 0.01) * factor, (was * was + 0.01) / factor}) {
      const auto found = surprises(std::sqrt(std::max(square - 0.01, 0.0)));
      ASSERT_EQ(found.size(), factor > 2 ? 1U : 0U) << square;
      EXPECT_TRUE(found.empty() || found[0].pixel == kBright);
    }
  }
}

// A pixel that is probed and looked at by none but its probe has no part in what its neighbours are expected to be.
TEST(ProbedPixels, LeaveTheirNeighboursAlone) {
  const FilmSnapshot film = wall_with_one_bright_half(3);
  const std::vector<core::ProbedPixel> probed = {{kBright, {core::Rgb(4), core::Rgb(4)}}};
  const auto expected = core::expected_values(film, {}, probed);
  for (std::uint32_t i = 0; i < kSide * kSide; ++i) {
    EXPECT_NEAR(static_cast<double>(expected[i].mean.g), i == kBright ? 4 : 0.3, 0.02) << i;
  }
}

}  // namespace
