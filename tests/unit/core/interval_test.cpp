// Every interval against its closed form: the ends at 95% (and at 50%, where the confidence is an
// argument) with quantiles from tables. Counts of covered truths hardly tell 90 from 95%; an end
// that is off by a fiftieth fails here. In their own files: ErrorEstimate, PixelError, the slopes
// of the laboratory and of convergence, LightNotFound, the cost of a job.
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/compare/comparison.h"
#include "core/denoise/denoised_picture.h"
#include "core/error/compared_error.h"
#include "core/film/meter_reading.h"

namespace {

using core::ErrorInterval;
using core::PixelErrors;
using core::Rgb;

/// Two-sided confidence and its normal quantile.
constexpr std::array kNormal = {std::pair(0.95, 1.959964), std::pair(0.5, 0.674490)};

/// Of 1,024 pixels: sum of r^2 = 2, and 8 by squares; grain 0.05, doubt 1/8.
core::TileSums plain_sums() {
  core::TileSums sums;
  sums.pixels = 1024;
  sums.grain = 1024 * 0.05;
  sums.squares = 2;
  sums.squares_of_blocks = 8;
  sums.doubt = 128;
  sums.has_halves = true;
  return sums;
}

// A denoised image errs by its own noise and by that of the images that it is compared with: 2 /
// 1024 = sqrt(2 * 2) / 1024 for independent pixels, 4 / 1024 for correlated ones.
TEST(Intervals, OfTheDenoisedErrorAreInClosedForm) {
  core::DenoisedPicture picture;
  picture.plain_tiles = {plain_sums()};
  picture.full_roots = {{1024 * 0.08}, 0.001};
  picture.mixed_roots = {{1024 * 0.04}, 0.002};
  for (const auto& [errors, noise] :
       {std::pair(PixelErrors::kIndependent, 2.0), std::pair(PixelErrors::kCorrelated, 4.0)}) {
    picture.errors = errors;
    for (const auto& [confidence, quantile] : kNormal) {
      picture.is_plain = false;
      const ErrorInterval full = picture.interval(core::DenoiseMode::kFull, confidence);
      const double full_reach = quantile * (noise / 1024 + 0.001);
      EXPECT_NEAR(full.relative, 0.08, 1e-9);
      EXPECT_NEAR(full.low, 0.8 * 0.08 * (1 - 0.125) - full_reach, 1e-7) << confidence;
      EXPECT_NEAR(full.high, 0.1 + 0.125 + full_reach, 1e-7) << confidence;
      const ErrorInterval mixed = picture.interval(core::DenoiseMode::kMixed, confidence);
      EXPECT_NEAR(mixed.high, 0.05 + 0.125 + quantile * (noise / 1024 + 0.002), 1e-7);
      picture.is_plain = true;
      const ErrorInterval plain = picture.interval(core::DenoiseMode::kMixed, confidence);
      EXPECT_NEAR(plain.high, 0.05 + 0.125 + quantile * noise / 1024, 1e-7) << confidence;
    }
  }
}

// Windows of 8 x 8 pixels are alike but for their sign on a chessboard, so the standard error of
// the roots is known from the noise alone; the interval must use it, and that of the references.
TEST(Intervals, OfAComparedErrorHaveTheConfidenceAskedFor) {
  core::FilmSnapshot image;
  image.rect = {0, 0, 32, 32};
  image.pixels.resize(image.pixel_count() * 2);
  core::FilmSnapshot references = image;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const float off = (i / 2 + i / 64) % 2 == 0 ? 0.1F : -0.1F;
    const float side = i % 2 == 0 ? off : -off;
    image.pixels[i] = {1.2F, 1.2F, 1.2F, 1, 0.1F, 8};
    references.pixels[i] = {1 + side, 1 + side, 1 + side, 1, 0.1F, 8};
  }
  const core::ErrorEstimate estimate = core::compared_error(image, references);
  const double at_95 = estimate.image(0.95).reach;
  // Of the references alone: r = 0.2 / (2 + 2 F) in each pixel, F = 0.05.
  EXPECT_GE(at_95, 1.959964 * std::sqrt(2 * 1024 * std::pow(0.2 / 2.1, 2)) / 1024 - 1e-6);
  EXPECT_NEAR(estimate.image(0.5).reach / at_95, 0.674490 / 1.959964, 1e-5);
}

// Gains of 10, 8, 12 and 10 in four tiles of 100 pixels, which would each have 10 of the whole: sum
// of squares 8. An empty tile does not count.
TEST(Intervals, OfTheGainOfAnImageAreStudents) {
  std::vector<core::TileSums> tiles(5);
  for (std::size_t t = 0; t < 4; ++t) {
    tiles[t].pixels = 100;
  }
  const core::ErrorRoots from = {{30, 28, 32, 30, 0}, 0};
  const core::ErrorRoots to = {{20, 20, 20, 20, 0}, 0};
  const double error = std::sqrt(8 * 4.0 / 3) / 400;
  // Student's t with 3 degrees of freedom.
  EXPECT_NEAR(core::reach_of_gain(from, to, tiles, 0.95), 3.182446 * error, 1e-7);
  EXPECT_NEAR(core::reach_of_gain(from, to, tiles, 0.5), 0.764892 * error, 1e-7);
  EXPECT_EQ(core::reach_of_gain({{30}, 0}, {{20}, 0}, std::span(tiles).first(1), 0.95),
            std::numeric_limits<double>::infinity())
      << "one tile is no evidence";
}

/// Four pixels whose halves are 0.1 off.
core::Picture four_pixels(float value) {
  core::Picture picture;
  picture.width = picture.height = 2;
  picture.values.assign(4, Rgb(value));
  picture.half_difference.assign(4, Rgb(0.1F));
  picture.sample_variance.assign(4, 0.01F);
  return picture;
}

double reach_of_bias(const core::Picture& a, const core::Picture& b) {
  const auto result = core::compare_pictures(a, b);
  EXPECT_TRUE(result);
  EXPECT_NEAR(result->bias, 0.5, 1e-6);
  EXPECT_NEAR(result->bias_high - result->bias, result->bias - result->bias_low, 1e-9);
  return result->bias_high - result->bias;
}

// Of n equal squares e^2 the sum has 3 n - 2 degrees of freedom by their fourth powers.
TEST(Intervals, OfABiasAreStudents) {
  const core::Picture a = four_pixels(1.5F);
  core::Picture b = four_pixels(1);
  EXPECT_NEAR(reach_of_bias(a, b), 2.073873 * std::sqrt(8 * 0.01) / 4, 1e-6) << "22 degrees";
  b.half_difference.clear();
  b.sample_variance.clear();
  b.is_exact = true;
  EXPECT_NEAR(reach_of_bias(a, b), 2.228139 * std::sqrt(4 * 0.01) / 4, 1e-6) << "10 degrees";
}

// By Welch and Satterthwaite two equal variances have twice the degrees of one; with one of them
// nine times the other, (10 v)^2 / ((9 v)^2 / 5 + v^2 / 5) = 6.098.
TEST(Intervals, OfABiasFromReplicatesAreWelchs) {
  core::Picture a = four_pixels(1.5F);
  core::Picture b = four_pixels(1);
  a.errors = b.errors = PixelErrors::kCorrelated;
  a.mean_variance = b.mean_variance = 0.0004;
  for (const auto& [degrees, quantile] : {std::pair(1, 4.302653), std::pair(5, 2.228139)}) {
    a.mean_degrees = b.mean_degrees = degrees;
    EXPECT_NEAR(reach_of_bias(a, b), quantile * std::sqrt(2 * 0.0004), 1e-6) << degrees;
  }
  a.mean_variance = 9 * 0.0004;
  // Between the quantiles of 6 and 7 degrees.
  EXPECT_LT(reach_of_bias(a, b), 2.446912 * std::sqrt(10 * 0.0004));
  EXPECT_GT(reach_of_bias(a, b), 2.364624 * std::sqrt(10 * 0.0004));
}

/// A reading from the sums of 16 randomisations, one path each.
core::MeterReading reading_of(const std::array<double, core::kMeterReplicates>& sums) {
  core::MeterChunk chunk;
  chunk.samples = 1;
  for (const double sum : sums) {
    chunk.sums.push_back({sum, sum, sum});
  }
  return core::meter_readings({{{0, 0, 0}, {0, 1, 0}}}, {chunk}).at(0);
}

// Eight randomisations are 1 above 10 and eight 1 below: a standard error of sqrt(16 / 15 / 16),
// and Student's t with 15 degrees of freedom.
TEST(Intervals, OfAMeterAreStudents) {
  std::array<double, core::kMeterReplicates> sums{};
  for (std::size_t r = 0; r < sums.size(); ++r) {
    sums[r] = r % 2 == 0 ? 11 : 9;
  }
  const core::MeterReading reading = reading_of(sums);
  EXPECT_NEAR(reading.illuminance - reading.low, 2.131450 * std::sqrt(1.0 / 15), 1e-6);
  EXPECT_NEAR(reading.high - reading.illuminance, 2.131450 * std::sqrt(1.0 / 15), 1e-6);
}

// One randomisation of 16 has met a single event of 160: with one seen, up to 5.572 may be due
// (Garwood 1936, 97.5%).
TEST(Intervals, OfAMeterWithOneEventEndAtThePoissonLimit) {
  std::array<double, core::kMeterReplicates> sums{};
  sums[3] = 160;
  const core::MeterReading reading = reading_of(sums);
  EXPECT_NEAR(reading.illuminance, 10, 1e-9);
  EXPECT_NEAR(reading.high, 5.572 * 10, 0.01);
}

// Both readings reach 3 below and 4 above: the ends of their difference are 5 away.
TEST(Intervals, OfADifferenceOfReadingsAreRootsOfSquares) {
  core::MeterReading a;
  a.illuminance = 20;
  a.low = 17;
  a.high = 24;
  core::MeterReading b = a;
  b.illuminance = 10;
  b.low = 7;
  b.high = 14;
  const core::ReadingDifference difference = core::difference_of(a, b);
  EXPECT_NEAR(difference.low, 10 - 5, 1e-9);
  EXPECT_NEAR(difference.high, 10 + 5, 1e-9);
}

}  // namespace
