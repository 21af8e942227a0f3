// The rows of the integrator registry by their `error`: what is called valid is held against the
// scatter of pictures, and what is called none is not reported.
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error/error_estimate.h"
#include "core/settings/registry.h"
#include "tests/support/errors.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::Rgb;

constexpr int kRenders = 60;
constexpr int kWidth = 48;
constexpr int kHeight = 32;
constexpr int kSamples = 16;

/// A box that every technique finds light in: diffuse walls, an emitter out of the picture.
core::View box(std::string_view integrator) {
  core::View view =
      test_support::view_of(test_support::build(test_support::cornell()), kWidth, kHeight);
  test_support::look_at(view, {0.5F, 0.5F, 2.2F}, {0.5F, 0.35F, 0}, 24);
  view.settings = core::default_settings(integrator);
  view.settings.film = {.width = kWidth, .height = kHeight, .crop = {}, .filter = {}, .shares = {}};
  view.settings.max_depth = 4;
  return view;
}

struct Seen {
  double covered = 0;  ///< share of pictures whose interval has the true error
  double ratio = 0;    ///< mean estimate over the true error
};

/// shared: how much of half A is mixed into half B; 0 but for the twin.
Seen measure(const core::IntegratorEntry& row, double shared, int renders = kRenders) {
  core::View view = box(row.name);
  std::vector<core::FilmSnapshot> films;
  std::vector<std::vector<core::TileSums>> sums;
  for (int i = 0; i < renders; ++i) {
    view.settings.seed = static_cast<std::uint64_t>(i) + 1;
    test_support::Picture picture = test_support::render(view, kSamples);
    films.push_back(std::move(picture.snapshot));
    const auto tiles = picture.film->half_sums();
    sums.emplace_back(tiles.begin(), tiles.end());
  }
  const double truth = test_support::defined_error(test_support::truth_of(films), kWidth, kHeight);
  const double left = (1.0 - shared) * (1.0 - shared);
  Seen seen;
  test_support::Moments estimates;
  for (std::vector<core::TileSums>& tiles : sums) {
    for (core::TileSums& tile : tiles) {
      tile.noise *= left;
      tile.noise_squares *= left * left;
    }
    const core::ErrorInterval e = core::ErrorEstimate(tiles).image(0.95);
    estimates.add(e.relative_rmse);
    seen.covered += e.low <= truth && truth <= e.high ? 1.0 / renders : 0.0;
  }
  seen.ratio = estimates.mean / truth;
  std::printf("    %s: image %.1f %%, estimate %+.1f %%\n", std::string(row.name).c_str(),
              100 * seen.covered, 100 * (seen.ratio - 1));
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
    // `auto` is one of the others.
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

// 60 intervals that cover 95 %: a standard deviation of 2.8 %, so 84 % is 3.9 of them away. The
// estimate's mean is known to 1 %.
TEST_P(RowWithAnError, IntervalsCoverTheScatterOfPictures) {
  const Seen seen = measure(*GetParam(), 0);
  EXPECT_GE(seen.covered, 0.84);
  EXPECT_NEAR(seen.ratio, 1, 0.05);
}

// The twin: half B has seen a fifth of what half A saw, so that the estimate is a fifth too low;
// from 15 pictures it is known to 2 %.
TEST_P(RowWithAnError, HalvesThatShareSamplesAreDetected) {
  EXPECT_LT(measure(*GetParam(), 0.2, 15).ratio, 0.9);
}

TEST_P(RowWithoutAnError, ErrorsAreNotValid) {
  EXPECT_FALSE(core::errors_are_valid(core::default_settings(GetParam()->name)));
}

INSTANTIATE_TEST_SUITE_P(Integrators, RowWithAnError, testing::ValuesIn(rows(true)), test_name);
INSTANTIATE_TEST_SUITE_P(Integrators, RowWithoutAnError, testing::ValuesIn(rows(false)), test_name);

}  // namespace
