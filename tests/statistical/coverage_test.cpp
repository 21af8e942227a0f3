// Confidence intervals of real renders: 150 renders with 150 seeds. The true value is the mean of
// the other 149 (tests/render compares these with closed forms); its own error is 1/149 of the
// variance. The intervals are not widened for it: the effect is 0.04% of coverage.
#include <cmath>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "core/error/error_estimate.h"
#include "core/error/pixel_error.h"
#include "core/layers/layers.h"
#include "tests/support/errors.h"
#include "tests/support/least_covered.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::Rgb;
using test_support::Moments;

constexpr int kRenders = 150;
/// Student's t with the 25 degrees of freedom of a window: 90 over 95%.
constexpr double kPixelAt90 = 1.708141 / 2.059539;

/// With the emitter in view, or not.
core::View cornell(core::SamplerType sampler, bool lamp = false) {
  core::View view = test_support::cornell_view(96, 64, lamp ? 40 : 24, lamp ? 0.5F : 0.35F);
  view.settings.sampler = sampler;
  view.settings.max_depth = 4;
  return view;
}

/// A metal ball and a white one on a floor, under an emitter and a dim environment.
core::View balls(core::SamplerType sampler, float roughness = 0.6F, float lamp_side = 0.8F) {
  core::MaterialDescription metal;
  metal.metallic = 1;
  metal.roughness = roughness;
  metal.base_color = {0.9F, 0.7F, 0.4F};
  const float s = lamp_side / 2;
  core::View view = test_support::view_of(
      test_support::scene_of(
          {test_support::lambert(Rgb(0.7F)), metal, test_support::emitter(Rgb(1.6F / (s * s)))},
          {test_support::quad({-4, 0, 4}, {8, 0, 0}, {0, 0, -6}, 0),
           test_support::sphere({-0.7F, 0.6F, 0}, 0.6F, 16, false, 1),
           test_support::sphere({0.7F, 0.6F, 0}, 0.6F, 16, false, 0),
           test_support::quad({-s, 3, -s}, {2 * s, 0, 0}, {0, 0, 2 * s}, 2)}),
      96, 64);
  test_support::look_at(view, {0, 1.2F, 4}, {0, 0.6F, 0}, 40);
  view.environment = test_support::constant_sky(Rgb(0.2F));
  view.settings.sampler = sampler;
  view.settings.max_depth = 4;
  return view;
}

struct Coverage {
  double tiles = 0;  ///< means of tiles, from the sum of their pixels' variances
  double pixels = 0;
  double tiles_at_90 = 0;  ///< the planted fault: the same intervals with the quantiles of 90%
  double pixels_at_90 = 0;
  double image = 0;       ///< low <= error of the image <= high
  double unreliable = 0;  ///< images flagged as unreliable
  double ratio = 0;       ///< mean of the estimate over the mean error
};

std::vector<core::FilmSnapshot> renders(core::View view, int samples) {
  std::vector<core::FilmSnapshot> films;
  for (int i = 0; i < kRenders; ++i) {
    view.settings.seed = static_cast<std::uint64_t>(i) + 1;
    films.push_back(std::move(test_support::render(view, samples).snapshot));
  }
  return films;
}

/// twin: plants a fault in each film before its error is estimated.
Coverage cover(std::vector<core::FilmSnapshot> films,
               const std::function<void(core::FilmSnapshot&)>& twin = {}) {
  const std::vector<core::PixelRect> tiles = core::tile_rects(films[0].rect);
  const int width = films[0].rect.width;
  const std::vector<double> errors = test_support::errors_of(films);
  std::vector<double> sum(films[0].pixel_count());
  for (const auto& film : films) {
    for (std::size_t p = 0; p < sum.size(); ++p) {
      sum[p] += static_cast<double>(core::pixel_value(film, p).mean.g);
    }
  }
  Coverage out;
  Moments estimates;
  Moments truths;
  for (std::size_t i = 0; i < films.size(); ++i) {
    core::FilmSnapshot& film = films[i];
    const core::FilmSnapshot whole = film;
    if (twin) {
      twin(film);
    }
    const auto e = core::ErrorEstimate(core::half_sums(film), film.errors).image(0.95);
    estimates.add(e.relative);
    truths.add(errors[i]);
    out.image += e.low <= errors[i] && errors[i] <= e.high ? 1.0 / kRenders : 0.0;
    out.unreliable += e.unreliable ? 1.0 / kRenders : 0.0;
    const auto variance = core::layer_image(film, "variance");
    for (const core::PixelRect& t : tiles) {
      double tile_mean = 0;
      double tile_truth = 0;
      double tile_variance = 0;
      for (int y = t.y; y < t.y + t.height; ++y) {
        for (int x = t.x; x < t.x + t.width; ++x) {
          const auto p = static_cast<std::size_t>(y * width + x);
          const auto v = static_cast<double>(core::pixel_value(whole, p).mean.g);
          const double others = (sum[p] - v) / (kRenders - 1);
          tile_mean += v;
          tile_truth += others;
          tile_variance += static_cast<double>(variance->values[3 * p + 1]);
          if (x % 2 == 0 && y % 2 == 0) {  // a quarter of the pixels is sufficient
            const core::Rgb width95 =
                core::pixel_error(film, x, y).high - core::pixel_value(film, p).mean;
            const double off = std::fabs(v - others);
            out.pixels += off <= static_cast<double>(width95.g) ? 1 : 0;
            out.pixels_at_90 += off <= kPixelAt90 * static_cast<double>(width95.g) ? 1 : 0;
          }
        }
      }
      const double tile_off = std::fabs(tile_mean - tile_truth);
      out.tiles += tile_off <= 1.959964 * std::sqrt(tile_variance) ? 1 : 0;
      out.tiles_at_90 += tile_off <= 1.644854 * std::sqrt(tile_variance) ? 1 : 0;
    }
  }
  for (double* fraction : {&out.tiles, &out.tiles_at_90}) {
    *fraction /= static_cast<double>(tiles.size()) * kRenders;
  }
  for (double* fraction : {&out.pixels, &out.pixels_at_90}) {
    *fraction /= static_cast<double>(sum.size()) / 4 * kRenders;
  }
  out.ratio = estimates.mean / truths.mean;
  std::printf(
      "    tiles %.2f %%  pixels %.2f %%  image %.1f %% (error %.4f, estimate %+.1f %%, "
      "unreliable %.0f %%)\n",
      100 * out.tiles, 100 * out.pixels, 100 * out.image, truths.mean, 100 * (out.ratio - 1),
      100 * out.unreliable);
  return out;
}

// Bounds of 900 tiles: each fails by chance with a probability of 0.3%. Pixels: 230,400 in windows
// of 25 count at least as 9,216; windows of unequal noise cover more, but less than intervals of
// 99%. Estimates are bracketed by half and twice the error; those of resolved noise are up to a
// half too high. The interval of the error is a bracket, which covers more than its level; its
// quantile has a closed form (tests/unit/core/error_estimate_test.cpp).
constexpr double kTiles = 900;
const double kTilesLeast = test_support::least_fraction(kTiles);
const double kTilesMost = test_support::most_fraction(kTiles);
const double kPixelsLeast = test_support::least_fraction(9216);
const double kPixelsBelow = test_support::least_fraction(9216, 0.99);
const double kImageLeast = test_support::least_fraction(kRenders);

void expect_calibrated(const Coverage& c) {
  EXPECT_GE(c.tiles, kTilesLeast);
  EXPECT_LE(c.tiles, kTilesMost);
  EXPECT_GE(c.pixels, kPixelsLeast);
  EXPECT_LT(c.pixels, kPixelsBelow);
  EXPECT_GE(c.image, kImageLeast);
  EXPECT_GT(c.ratio, 0.9);
  EXPECT_LT(c.ratio, 1.5);
}

TEST(Coverage, IsCalibratedInTheCornellBoxWithSobol) {
  const auto films = renders(cornell(core::SamplerType::kSobol), 8);
  const Coverage c = cover(films);
  expect_calibrated(c);
  EXPECT_LT(c.tiles_at_90, kTilesLeast) << "intervals of 90% are detected";
  EXPECT_LT(c.pixels_at_90, kPixelsLeast) << "intervals of 90% are detected";
  // The planted fault: half B contains half of the samples of half A.
  const Coverage shared =
      cover(films, [](core::FilmSnapshot& film) { test_support::share_half(film, 0.5F); });
  EXPECT_LT(shared.tiles, kTilesLeast);
  EXPECT_LT(shared.image, 0.5);
  EXPECT_LT(shared.ratio, 0.9);
}
TEST(Coverage, IsCalibratedForTwoBallsWithSobol) {
  expect_calibrated(cover(renders(balls(core::SamplerType::kSobol), 8)));
}
TEST(Coverage, IsCalibratedForTwoBallsWithIndependentSamples) {
  expect_calibrated(cover(renders(balls(core::SamplerType::kIndependent), 8)));
}

// The pilot stream decides at 24 samples, the image has 32. 600 tiles.
TEST(Coverage, IsCalibratedInTheCornellBoxWithAdaptiveSampling) {
  core::View view = cornell(core::SamplerType::kSobol);
  view.settings.film.width = 64;
  view.settings.adaptive.type = core::AdaptiveType::kPilot;
  view.settings.adaptive.min_samples = 24;
  const auto picture = test_support::render(view, 32);
  EXPECT_LT(picture.progress.samples_min, picture.progress.samples_max);
  const Coverage c = cover(renders(view, 32));
  const double least = test_support::least_fraction(600);
  EXPECT_GE(c.tiles, least);
  EXPECT_LE(c.tiles, test_support::most_fraction(600));
  EXPECT_LT(c.tiles_at_90, least) << "intervals of 90% are detected";
  EXPECT_GE(c.pixels, kPixelsLeast);
  EXPECT_LT(c.pixels, kPixelsBelow);
  EXPECT_GE(c.image, kImageLeast);
  EXPECT_GT(c.ratio, 0.9);
  EXPECT_LT(c.ratio, 1.5);
}

// The emitter boundary carries the error: few pixels, some of them rarely hit by samples.
TEST(Coverage, IsCalibratedWithAnEmitterInTheImage) {
  const Coverage c = cover(renders(cornell(core::SamplerType::kSobol, true), 8));
  EXPECT_GE(c.tiles, kTilesLeast);
  EXPECT_LE(c.tiles, kTilesMost);
  EXPECT_GE(c.image, kImageLeast);
  EXPECT_GT(c.ratio, 0.9);
  EXPECT_LT(c.ratio, 1.5);
}

// A small emitter reflected by a polished ball: caustics that few samples find. A tile without such
// a sample has no information about them: its interval is too short, and 95% falls to 90%.
// The estimate of the whole image remains correct.
TEST(Coverage, OfRareCausticsIsLowByAFewPercent) {
  const Coverage c = cover(renders(balls(core::SamplerType::kSobol, 0.35F, 0.4F), 8));
  EXPECT_GE(c.tiles, test_support::least_fraction(kTiles, 0.9));
  EXPECT_LT(c.tiles, kTilesLeast) << "no longer low";
  EXPECT_GE(c.pixels, kPixelsLeast);
  EXPECT_GE(c.image, kImageLeast);
}

}  // namespace
