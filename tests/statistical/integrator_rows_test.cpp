// The rows of the integrator registry by their `error`: intervals of valid estimates must cover,
// for the image the true error and for pixels the values of an independent, much longer render;
// `none` reports no error.
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error/error_estimate.h"
#include "core/error/pixel_error.h"
#include "core/settings/registry.h"
#include "tests/support/errors.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::Rgb;

constexpr int kRenders = 200;
constexpr int kWidth = 24;
constexpr int kHeight = 16;
constexpr int kSamples = 16;
constexpr int kReferenceSamples = 1024;

/// A box in which every technique finds light: diffuse walls, an emitter outside the view.
core::View box(std::string_view integrator) {
  core::View view =
      test_support::view_of(test_support::build(test_support::cornell()), kWidth, kHeight);
  test_support::look_at(view, {0.5F, 0.5F, 2.2F}, {0.5F, 0.35F, 0}, 24);
  view.settings = core::default_settings(integrator);
  view.settings.film = {.width = kWidth, .height = kHeight, .crop = {}, .filter = {}, .shares = {}};
  view.settings.max_depth = integrator == "direct" ? 1 : 4;
  return view;
}

/// Rendered by path for every row. Its own noise increases the variance of the difference by 16 /
/// 1024 / 2 = 0.8%, or three times that if a row has a third of path's variance: 0.1 to 0.3% of
/// coverage.
core::FilmSnapshot reference(std::string_view integrator) {
  core::View view = box("path");
  view.settings.max_depth = box(integrator).settings.max_depth;
  view.settings.seed = 1'000'000;
  return test_support::render(view, kReferenceSamples).snapshot;
}

/// Fractions of intervals that contain the true value.
struct Covered {
  double image = 0;   ///< of the image's true error
  double pixels = 0;  ///< of the pixels of the reference
};

struct Seen {
  Covered whole;
  Covered halved;    ///< planted fault: intervals of half the length
  double ratio = 0;  ///< mean ratio of the estimated to the true error of the image
};

/// One pixel of each window that pixel_error() pools.
void count_pixels(const core::FilmSnapshot& film, const core::FilmSnapshot& truth, Seen& seen) {
  constexpr int kStep = 2 * core::kErrorWindow + 1;
  constexpr int kPixels = (kWidth / kStep) * (kHeight / kStep);
  for (int y = core::kErrorWindow; y + core::kErrorWindow < kHeight; y += kStep) {
    for (int x = core::kErrorWindow; x + core::kErrorWindow < kWidth; x += kStep) {
      const auto at = static_cast<std::size_t>(y * kWidth + x);
      const float mean = core::pixel_value(film, at).mean.g;
      const float off = std::fabs(mean - core::pixel_value(truth, at).mean.g);
      const float half = core::pixel_error(film, x, y).high.g - mean;
      seen.whole.pixels += off <= half ? 1.0 / kPixels : 0.0;
      seen.halved.pixels += off <= half / 2 ? 1.0 / kPixels : 0.0;
    }
  }
}

/// shared: fraction of half A mixed into half B; 0 except for the planted fault.
Seen measure(const core::IntegratorEntry& row, double shared, int renders = kRenders) {
  core::View view = box(row.name);
  const core::FilmSnapshot truth = reference(row.name);
  std::vector<core::FilmSnapshot> films;
  std::vector<std::vector<core::TileSums>> sums;
  Seen seen;
  for (int i = 0; i < renders; ++i) {
    view.settings.seed = static_cast<std::uint64_t>(i) + 1;
    test_support::Picture picture = test_support::render(view, kSamples);
    count_pixels(picture.snapshot, truth, seen);
    films.push_back(std::move(picture.snapshot));
    const auto tiles = picture.film->half_sums();
    sums.emplace_back(tiles.begin(), tiles.end());
  }
  const double error = test_support::defined_error(test_support::truth_of(films), kWidth, kHeight);
  const double left = (1.0 - shared) * (1.0 - shared);
  test_support::Moments estimates;
  for (std::vector<core::TileSums>& tiles : sums) {
    for (core::TileSums& tile : tiles) {
      tile.noise *= left;
      tile.noise_squares *= left * left;
    }
    const core::ErrorInterval e = core::ErrorEstimate(tiles).image(0.95);
    estimates.add(e.relative_rmse);
    seen.whole.image += e.low <= error && error <= e.high ? 1 : 0;
    // Intervals of the error are symmetric in its logarithm.
    seen.halved.image +=
        std::sqrt(e.low * e.relative_rmse) <= error && error <= std::sqrt(e.high * e.relative_rmse)
            ? 1
            : 0;
  }
  for (Covered* covered : {&seen.whole, &seen.halved}) {
    covered->image /= renders;
    covered->pixels /= renders;
  }
  seen.ratio = estimates.mean / error;
  std::printf(
      "    %s: image %.1f %% (halved %.1f %%), pixels %.2f %% (%.2f %%), estimate %+.1f %%\n",
      std::string(row.name).c_str(), 100 * seen.whole.image, 100 * seen.halved.image,
      100 * seen.whole.pixels, 100 * seen.halved.pixels, 100 * (seen.ratio - 1));
  return seen;
}

std::string test_name(const testing::TestParamInfo<const core::IntegratorEntry*>& info) {
  std::string name(info.param->name);
  for (char& c : name) {
    c = c == '-' ? '_' : c;
  }
  return name;
}

std::vector<const core::IntegratorEntry*> rows(bool has_error) {
  std::vector<const core::IntegratorEntry*> out;
  for (const core::IntegratorEntry& row : core::integrators()) {
    // `auto` runs one of the others.
    if (row.name != core::kAutomaticIntegrator &&
        (row.error != core::ErrorValidity::kNone) == has_error) {
      out.push_back(&row);
    }
  }
  return out;
}

class RowWithAnError : public testing::TestWithParam<const core::IntegratorEntry*> {};
class RowWithoutAnError : public testing::TestWithParam<const core::IntegratorEntry*> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(RowWithoutAnError);

// 200 intervals of the error that cover 95%: 176 or fewer contain it with a probability of 7e-5 by
// the binomial distribution. Pixels: 200 x 12, which a chain may correlate within an image, so the
// tolerance is that of 200, 95% +- 4 standard deviations of 1.5%. The mean of the estimate has a
// standard error of 1%.
TEST_P(RowWithAnError, IntervalsCover) {
  const Seen seen = measure(*GetParam(), 0);
  EXPECT_GT(seen.whole.image, 0.88);
  EXPECT_GT(seen.whole.pixels, 0.89);
  EXPECT_NEAR(seen.ratio, 1, 0.05);
  // The planted faults.
  EXPECT_LT(seen.halved.image, 0.88);
  EXPECT_LT(seen.halved.pixels, 0.89);
}

// The planted fault: half B contains a fifth of the samples of half A, so the estimate is a fifth
// too low; 15 images determine it to 2%.
TEST_P(RowWithAnError, DetectsHalvesThatShareSamples) {
  EXPECT_LT(measure(*GetParam(), 0.2, 15).ratio, 0.9);
}

TEST_P(RowWithoutAnError, DoesNotReportAValidError) {
  EXPECT_FALSE(core::errors_are_valid(core::default_settings(GetParam()->name)));
}

INSTANTIATE_TEST_SUITE_P(Integrators, RowWithAnError, testing::ValuesIn(rows(true)), test_name);
INSTANTIATE_TEST_SUITE_P(Integrators, RowWithoutAnError, testing::ValuesIn(rows(false)), test_name);

}  // namespace
