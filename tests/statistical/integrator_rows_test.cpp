// The rows of the integrator registry that have valid errors: intervals must cover, for the image
// the true error and for pixels the values of an independent, much longer render. Others refuse
// error targets (tests/unit/api/error_targets_test.cpp).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error/error_estimate.h"
#include "core/error/pixel_error.h"
#include "core/integrators/registry.h"
#include "tests/support/caustic.h"
#include "tests/support/errors.h"
#include "tests/support/least_covered.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::Rgb;

constexpr int kRenders = 200;
constexpr int kWidth = 24;
constexpr int kHeight = 16;

/// A box in which every technique finds light: diffuse walls, an emitter outside the view.
core::View box(std::string_view integrator) {
  core::View view = test_support::cornell_view(kWidth, kHeight, 24, 0.35F);
  view.settings = core::default_settings(integrator);
  view.settings.film = {.width = kWidth, .height = kHeight, .crop = {}, .filter = {}, .shares = {}};
  view.settings.max_depth = integrator == "direct" ? 1 : 4;
  return view;
}

/// A ball in fog under a sky that is brighter on one side. Near a small emitter rare paths would
/// carry most of the noise, and so few samples know little of it.
core::View fog(std::string_view integrator) {
  core::View view = test_support::view_of(
      test_support::scene_of({test_support::lambert({0.7F, 0.5F, 0.3F})},
                             {test_support::quad({-2, 0, 2}, {4, 0, 0}, {0, 0, -4}, 0),
                              test_support::sphere({0, 0.6F, 0}, 0.6F, 12, false, 0)}),
      kWidth, kHeight);
  test_support::look_at(view, {0, 1, 3}, {0, 0.5F, 0}, 40);
  view.settings = box(integrator).settings;
  view.environment = test_support::sky_map(
      16, 8, [](int x, int /*y*/) { return Rgb(0.5F + 0.1F * static_cast<float>(x % 8)); });
  view.settings.fog =
      core::FogSettings{.scattering = Rgb(0.4F), .absorption = Rgb(0.1F), .g = 0.3F};
  return view;
}

core::View spectral_box(std::string_view integrator) {
  core::View view = box(integrator);
  view.settings.spectral = true;
  return view;
}

/// The caustic below a glass ball. Only the floor is in view: light that is seen through glass is
/// too rare for so few samples.
core::View caustic(std::string_view integrator) {
  core::View view = test_support::caustic();
  test_support::look_at(view, {0, 0.18F, 1}, {0, 0, 0}, 12);
  view.settings = box(integrator).settings;
  view.settings.max_depth = 6;
  return view;
}

/// Integrator, scene and the integrator of its reference, which renders other samples.
struct Row {
  std::string_view integrator;
  const char* scene = "box";
  core::View (*view)(std::string_view integrator) = &box;
  const char* reference = "path";
  int samples = 16;
};
void PrintTo(const Row& row, std::ostream* out) { *out << row.integrator << " " << row.scene; }

/// Its own noise increases the variance of the difference by 1 / 64 / 2 = 0.8% if a sample has the
/// variance of one of the row, three times that if the row has a third of it: 0.1 to 0.3% of
/// coverage.
core::FilmSnapshot reference(const Row& row) {
  core::View view = row.view(row.reference);
  view.settings.max_depth = row.view(row.integrator).settings.max_depth;
  view.settings.seed = 1'000'000;
  return test_support::render(view, 64 * row.samples).snapshot;
}

/// Fractions of intervals that contain the true value.
struct Covered {
  double image = 0;   ///< of the image's true error
  double pixels = 0;  ///< of the pixels of the reference
};

struct Seen {
  Covered whole;
  Covered halved;     ///< planted faults: halves that share half of A; half of a pixel's interval
  double ratio = 0;   ///< mean ratio of the estimated to the true error of the image
  double shared = 0;  ///< planted fault: the same if half B contains half of A's samples
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

core::ErrorInterval error_of(const core::FilmSnapshot& film) {
  return core::ErrorEstimate(core::half_sums(film), film.errors).image(0.95);
}

Seen measure(const Row& row) {
  core::View view = row.view(row.integrator);
  const core::FilmSnapshot truth = reference(row);
  std::vector<core::FilmSnapshot> films;
  Seen seen;
  for (int i = 0; i < kRenders; ++i) {
    view.settings.seed = static_cast<std::uint64_t>(i) + 1;
    films.push_back(test_support::render(view, row.samples).snapshot);
    count_pixels(films.back(), truth, seen);
  }
  const std::vector<double> errors = test_support::errors_of(films);
  test_support::Moments estimates;
  test_support::Moments shared;
  test_support::Moments truths;
  for (std::size_t i = 0; i < films.size(); ++i) {
    const core::ErrorInterval e = error_of(films[i]);
    test_support::share_half(films[i], 0.5F);
    const core::ErrorInterval faulty = error_of(films[i]);
    seen.whole.image += e.low <= errors[i] && errors[i] <= e.high ? 1.0 / kRenders : 0;
    seen.halved.image += faulty.low <= errors[i] && errors[i] <= faulty.high ? 1.0 / kRenders : 0;
    estimates.add(e.relative);
    shared.add(faulty.relative);
    truths.add(errors[i]);
  }
  for (Covered* covered : {&seen.whole, &seen.halved}) {
    covered->pixels /= kRenders;
  }
  seen.ratio = estimates.mean / truths.mean;
  seen.shared = shared.mean / truths.mean;
  std::printf(
      "    image %.1f %% (shared halves %.1f %%), pixels %.2f %% (halved %.2f %%), estimate %+.1f "
      "%% (%+.1f %%)\n",
      100 * seen.whole.image, 100 * seen.halved.image, 100 * seen.whole.pixels,
      100 * seen.halved.pixels, 100 * (seen.ratio - 1), 100 * (seen.shared - 1));
  return seen;
}

std::string test_name(const testing::TestParamInfo<Row>& info) {
  std::string name = std::string(info.param.integrator) + "_in_" + info.param.scene;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

std::vector<Row> rows() {
  std::vector<Row> out;
  for (const core::IntegratorEntry& row : core::integrators()) {
    // `auto` runs one of the others.
    if (row.name != core::kAutomaticIntegrator && row.error != core::ErrorValidity::kByComparison) {
      // A sample of Metropolis is eight states.
      out.push_back({.integrator = row.name, .samples = row.name == "mlt" ? 4 : 16});
    }
  }
  out.push_back({"path", "fog", &fog, "path", 8});
  out.push_back({"bdpt", "fog", &fog, "path", 8});
  out.push_back({"path", "spectral_box", &spectral_box});
  // Too few paths find the caustic.
  out.push_back({"bdpt", "caustic", &caustic, "bdpt", 8});
  out.push_back({"mlt", "caustic", &caustic, "bdpt", 4});
  return out;
}

class RowWithAnError : public testing::TestWithParam<Row> {};

// 200 intervals of the error. Pixels: 200 x 12, which a chain may correlate within an image, so
// they count as 200. Estimates are bracketed by half and twice the error.
TEST_P(RowWithAnError, IntervalsCover) {
  const Seen seen = measure(GetParam());
  const double least = test_support::least_fraction(kRenders);
  EXPECT_GE(seen.whole.image, least);
  EXPECT_GE(seen.whole.pixels, least);
  EXPECT_GT(seen.ratio, 0.85);
  EXPECT_LT(seen.ratio, 1.6);
  // The planted faults.
  EXPECT_LT(seen.halved.image, least);
  EXPECT_LT(seen.halved.pixels, least);
  EXPECT_LT(seen.shared, 0.75 * seen.ratio);
}

INSTANTIATE_TEST_SUITE_P(Integrators, RowWithAnError, testing::ValuesIn(rows()), test_name);

}  // namespace
