// Visible emitters are part of the features, so a denoiser keeps them.
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "core/denoise/denoised_picture.h"
#include "core/denoise/statistical.h"
#include "tests/support/statistics.h"

namespace {

using test_support::Random;

constexpr int kSide = 64;
constexpr int kSamples = 16;  ///< per half

/// Small emitters on a wall, each covering a fraction of one pixel. Returns the squared errors of
/// these pixels in the plain and in the denoised image.
std::array<double, 2> errors_at_a_lamp(bool knows_lamp) {
  constexpr double kWall = 0.3;
  constexpr double kLamp = 17;
  constexpr double kCovered = 0.4;
  constexpr int kFeatureSamples = 16;
  Random random(3);
  const auto is_lamp = [](std::size_t i) { return i % kSide % 12 == 6 && i / kSide % 12 == 6; };
  const auto covered = [&](std::size_t i) {
    return is_lamp(i) && random.uniform_double() < kCovered ? 1.0 : 0.0;
  };
  core::FilmSnapshot film;
  film.rect = {0, 0, kSide, kSide};
  film.pixels.resize(film.pixel_count() * 2);
  core::FeaturePicture features = core::FeaturePicture::blank(kSide, kSide);
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    for (std::size_t half = 0; half < 2; ++half) {
      test_support::Moments light;
      for (int s = 0; s < kSamples; ++s) {
        const double lamp = covered(i);
        light.add(lamp * kLamp + (1 - lamp) * kWall * (1 + 0.4 * random.normal()));
      }
      const auto v = static_cast<float>(light.mean);
      film.pixels[2 * i + half] = {v, v, v, 1, static_cast<float>(light.m2), kSamples};
    }
    test_support::Moments lamp;
    for (int s = 0; s < kFeatureSamples; ++s) {
      lamp.add(covered(i));
    }
    for (std::size_t c = 0; c < 3; ++c) {
      features.albedo[c][i] = 0.5F;
      features.emission[c][i] = knows_lamp ? static_cast<float>(kLamp * lamp.mean) : 0;
    }
    const double variance = lamp.m2 / (kFeatureSamples - 1) / kFeatureSamples;
    features.emission_variance[i] =
        knows_lamp ? static_cast<float>(3 * kLamp * kLamp * variance) : 0;
    features.depth_m[i] = 1;
  }
  const core::StatisticalDenoiser denoiser;
  const auto made = core::denoise(film, &features, denoiser, core::parallel_for(2));
  EXPECT_TRUE(made);
  const double truth = kCovered * kLamp + (1 - kCovered) * kWall;
  std::array<double, 2> out = {};
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    if (is_lamp(i)) {
      out[0] += std::pow(static_cast<double>(core::pixel_value(film, i).mean.r) - truth, 2);
      out[1] += std::pow(static_cast<double>(made->picture.full[0][i]) - truth, 2);
    }
  }
  return out;
}

TEST(DenoisedPicture, CountsTheSamplesOfTheSmallestHalf) {
  core::FilmSnapshot film;
  film.rect = {0, 0, 4, 4};
  film.pixels.assign(film.pixel_count() * 2, {1, 1, 1, 1, 0, 8});
  EXPECT_EQ(core::samples_of_halves(film), 8);
  film.pixels[17].count = 1;
  EXPECT_EQ(core::samples_of_halves(film), 1);
  film.pixels[30] = {};
  EXPECT_EQ(core::samples_of_halves(film), 0);
}

TEST(StatisticalDenoiser, KeepsEmittersSmallerThanAPixel) {
  const auto [plain, denoised] = errors_at_a_lamp(true);
  // The features have half as many samples as the image: twice its variance, and over 25 pixels at
  // most a factor of 3.3 by chance (the 0.998 quantile of F with 25 and 25 degrees of freedom).
  EXPECT_LT(denoised, 2 * 3.3 * plain);
  const auto [same, blurred] = errors_at_a_lamp(false);  // planted fault: features without emitters
  EXPECT_GT(blurred, 2 * 3.3 * same);
}

}  // namespace
