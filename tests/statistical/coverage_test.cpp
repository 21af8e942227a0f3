// Error bars of real renders: 200 renders with 200 seeds. The truth is the mean of the other 199 (which themselves are held
// against closed forms in tests/render), its own error 1/199 of the variance; intervals are widened by nothing for it:
// the effect is 0.03 % of coverage.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/film/error_estimate.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::Rgb;
using test_support::Moments;

constexpr int kRenders = 200;

/// lamp: in the picture. The rim of a lamp is as rare and as bright as a firefly: see the last test.
core::View cornell(core::SamplerType sampler, bool lamp = false) {
  core::View view = test_support::view_of(test_support::build(test_support::cornell()), 96, 64);
  test_support::look_at(view, {0.5F, 0.5F, 2.2F}, {0.5F, lamp ? 0.5F : 0.35F, 0}, lamp ? 40 : 24);
  view.settings.sampler = sampler;
  view.settings.max_depth = 4;
  return view;
}

/// A metal ball and a white one on a floor, under a lamp and a dim sky.
core::View balls(core::SamplerType sampler, float roughness = 0.6F, float lamp_side = 0.8F) {
  core::MaterialDescription metal;
  metal.metallic = 1;
  metal.roughness = roughness;
  metal.base_color = {0.9F, 0.7F, 0.4F};
  const float s = lamp_side / 2;
  core::View view = test_support::view_of(
      test_support::build(test_support::scene_of(
          {test_support::lambert(Rgb(0.7F)), metal, test_support::emitter(Rgb(1.6F / (s * s)))},
          {test_support::quad({-4, 0, 4}, {8, 0, 0}, {0, 0, -6}, 0), test_support::sphere({-0.7F, 0.6F, 0}, 0.6F, 16, false, 1),
           test_support::sphere({0.7F, 0.6F, 0}, 0.6F, 16, false, 0),
           test_support::quad({-s, 3, -s}, {2 * s, 0, 0}, {0, 0, 2 * s}, 2)})), 96, 64);
  test_support::look_at(view, {0, 1.2F, 4}, {0, 0.6F, 0}, 40);
  view.environment = test_support::constant_sky(Rgb(0.2F));
  view.settings.sampler = sampler;
  view.settings.max_depth = 4;
  return view;
}

struct Coverage {
  double tiles = 0;
  double pixels = 0;
  double image = 0;            ///< low <= true relative error <= high
  double not_low = 0;          ///< true relative error <= high
  double reliable = 0;         ///< tiles that are not called unreliable: share
  double ratio = 0;            ///< mean of the estimate over the true relative error
  std::array<double, 6> by_brightness{};  ///< pixels, from the darkest fifth to the brightest; then those without noise
};

/// For each pixel that has noise the fifth of these that its value belongs to; 5: it has none.
std::vector<std::size_t> fifths(const std::vector<double>& values, const std::vector<double>& variances) {
  const auto has_noise = [&](std::size_t p) { return variances[p] > 1e-10 * values[p] * values[p]; };
  std::vector<double> sorted;
  for (std::size_t p = 0; p < values.size(); ++p) {
    if (has_noise(p)) {
      sorted.push_back(values[p]);
    }
  }
  std::sort(sorted.begin(), sorted.end());
  std::vector<std::size_t> out;
  for (std::size_t p = 0; p < values.size(); ++p) {
    const auto below = static_cast<std::size_t>(std::lower_bound(sorted.begin(), sorted.end(), values[p]) - sorted.begin());
    out.push_back(has_noise(p) ? below * 5 / sorted.size() : 5);
  }
  return out;
}

Coverage cover(core::View view, int samples) {
  std::vector<core::FilmSnapshot> films;
  std::vector<core::PixelRect> tiles;
  for (int i = 0; i < kRenders; ++i) {
    view.settings.seed = static_cast<std::uint64_t>(i) + 1;
    auto picture = test_support::render(view, samples);
    if (tiles.empty()) {
      tiles = core::tile_rects(picture.film->crop());
    }
    films.push_back(std::move(picture.snapshot));
  }
  const std::size_t n = films[0].pixel_count();
  const int width = films[0].rect.width;
  std::vector<double> sum(n, 0.0);
  std::vector<double> squares(n, 0.0);
  for (const auto& film : films) {
    for (std::size_t p = 0; p < n; ++p) {
      const auto v = static_cast<double>(core::pixel_value(film, p).mean.g);
      sum[p] += v;
      squares[p] += v * v;
    }
  }
  // The error is asked for in green: the channels of a grey film are one.
  double relative = 0;
  std::vector<double> means(n);
  std::vector<double> variances(n);
  for (std::size_t p = 0; p < n; ++p) {
    means[p] = sum[p] / kRenders;
    variances[p] = (squares[p] / kRenders - means[p] * means[p]) * kRenders / (kRenders - 1);
    relative += variances[p] / (means[p] * means[p] + 0.01);
  }
  const double truth = std::sqrt(relative / static_cast<double>(n));
  const std::vector<std::size_t> fifth = fifths(means, variances);
  std::array<double, 6> in_fifth{};
  for (const std::size_t k : fifth) {
    in_fifth[k] += kRenders;
  }
  Coverage out;
  Moments estimates;
  for (const auto& film : films) {
    core::FilmSnapshot grey = film;
    for (auto& p : grey.pixels) {
      p.mean_r = p.mean_b = p.mean_g;
    }
    const core::ErrorEstimate estimate(grey);
    const auto e = estimate.image(0.95);
    estimates.add(e.relative_rmse);
    out.image += e.low <= truth && truth <= e.high ? 1.0 / kRenders : 0.0;
    out.not_low += truth <= e.high ? 1.0 / kRenders : 0.0;
    const auto variance = core::layer_image(film, "variance");
    for (const core::PixelRect& t : tiles) {
      double tile_mean = 0;
      double tile_truth = 0;
      double tile_variance = 0;
      for (int y = t.y; y < t.y + t.height; ++y) {
        for (int x = t.x; x < t.x + t.width; ++x) {
          const auto p = static_cast<std::size_t>(y * width + x);
          const auto v = static_cast<double>(core::pixel_value(film, p).mean.g);
          const double others = (sum[p] - v) / (kRenders - 1);
          tile_mean += v;
          tile_truth += others;
          tile_variance += static_cast<double>(variance->values[3 * p + 1]);
          const auto interval = estimate.pixel(x, y);
          const bool inside = static_cast<double>(interval.low.g) <= others && others <= static_cast<double>(interval.high.g);
          out.pixels += inside ? 1 : 0;
          out.by_brightness[fifth[p]] += inside ? 1 / in_fifth[fifth[p]] : 0;
        }
      }
      out.tiles += std::fabs(tile_mean - tile_truth) <= 1.959964 * std::sqrt(tile_variance) ? 1 : 0;
      out.reliable += estimate.region(t, 0.95).unreliable ? 0 : 1;
    }
  }
  const double all = static_cast<double>(tiles.size()) * kRenders;
  out.tiles /= all;
  out.reliable /= all;
  out.pixels /= static_cast<double>(n) * kRenders;
  out.ratio = estimates.mean / truth;
  std::printf("    tiles %.2f %% (%.1f %% called reliable)  pixels %.2f %%  image %.1f %% (true error %.4f, estimate "
              "%+.1f %%)\n", 100 * out.tiles, 100 * out.reliable, 100 * out.pixels, 100 * out.image, truth,
              100 * (out.ratio - 1));
  std::printf("    pixels from dark to bright:");
  for (std::size_t k = 0; k < 5; ++k) {
    std::printf(" %.1f", 100 * out.by_brightness[k]);
  }
  std::printf(" %%\n");
  return out;
}

// 1,200 tiles: a standard deviation of 0.63 %; 93 and 97 % are 3.2 of them away: false alarm 0.15 % for each of four.
void expect_calibrated(const Coverage& c) {
  EXPECT_GE(c.tiles, 0.93);
  EXPECT_LE(c.tiles, 0.97);
  EXPECT_GE(c.pixels, 0.90);
  EXPECT_LE(c.pixels, 0.99);
  // 200 renders of some 1,200 pixels: 0.05 %. What is allowed beyond 95 % is for rare light, which skews errors.
  for (std::size_t k = 0; k < 5; ++k) {
    EXPECT_GE(c.by_brightness[k], 0.925) << k;
    EXPECT_LE(c.by_brightness[k], 0.985) << k;
  }
  // The bounds of the error itself; 200 trials, standard deviation 2.5 %. The variance of a real picture has heavier tails
  // than planted noise, whose bounds cover 93 to 98 %: here 85 to 93 % were measured.
  EXPECT_GE(c.image, 0.80);
  EXPECT_NEAR(c.ratio, 1, 0.05);
}

TEST(Coverage, OfTheCornellBoxWithSobol) { expect_calibrated(cover(cornell(core::SamplerType::kSobol), 8)); }
TEST(Coverage, OfTheCornellBoxWithIndependentSamples) { expect_calibrated(cover(cornell(core::SamplerType::kIndependent), 8)); }
TEST(Coverage, OfTwoBallsWithSobol) { expect_calibrated(cover(balls(core::SamplerType::kSobol), 8)); }
TEST(Coverage, OfTwoBallsWithIndependentSamples) { expect_calibrated(cover(balls(core::SamplerType::kIndependent), 8)); }

// The pilot stream decides at 24 samples, the picture has 32; 800 tiles: a standard deviation of 0.77 %.
TEST(Coverage, OfTheCornellBoxWithAdaptiveSampling) {
  core::View view = cornell(core::SamplerType::kSobol);
  view.settings.film.width = 64;
  view.settings.adaptive.type = core::AdaptiveType::kPilot;
  view.settings.adaptive.min_samples = 24;
  const auto picture = test_support::render(view, 32);
  EXPECT_LT(picture.progress.samples_min, picture.progress.samples_max);
  expect_calibrated(cover(view, 32));
}

// With the lamp in the picture, a pixel of its rim that one sample of eight found bright cannot be told from a firefly on the
// wall: the estimate is then too high, never too low.
TEST(Coverage, ALampsRimIsNeverTakenTooLightly) {
  const Coverage c = cover(cornell(core::SamplerType::kSobol, true), 8);
  EXPECT_GE(c.tiles, 0.92);
  EXPECT_GE(c.not_low, 0.95);
  EXPECT_LT(c.ratio, 1.25);
}

// A small lamp in a polished ball: caustics that few samples find. A tile that missed them cannot know: its interval is too
// short, and 95 % falls to some 90 %. The estimate of the picture as a whole stays right.
TEST(Coverage, OfRareCausticsFallsShortByAFewPercent) {
  const Coverage c = cover(balls(core::SamplerType::kSobol, 0.35F, 0.4F), 8);
  EXPECT_GE(c.tiles, 0.86);
  EXPECT_GE(c.pixels, 0.90);
  EXPECT_NEAR(c.ratio, 1, 0.1);
  EXPECT_LT(c.reliable, 0.75) << "nearly half of these tiles are called unreliable";
}

}  // namespace
