// Coefficients fitted to a film's own samples: the solution is correct, and its bits are
// independent of scheduling.
#include "core/film/replicate_fit.h"

#include <gtest/gtest.h>

#include "core/integrators/registry.h"
#include "core/render/picture/tile_fill.h"
#include "core/render/task/settle.h"
#include "core/sampling/optimal_mis.h"
#include "tests/support/scenes.h"
#include "tests/support/tasks.h"

namespace {

using core::Film;
using core::FitSample;
using core::FitType;
using core::RenderTask;
using core::ReplicateFit;
using core::Rgb;
using test_support::renderer_of;
using test_support::samples;

TEST(OptimalMis, SolvesItsLinearSystem) {
  // f = 3 p - 2 q for densities that take two values of p / m, 1/4 and 3/4.
  const core::OptimalMisMatrix a = {0.0625 + 0.5625, 2 * 0.1875, 0.5625 + 0.0625};
  const double fp = 3 * a.pp - 2 * a.pq;
  const double fq = 3 * a.pq - 2 * a.qq;
  const core::OptimalMisCoefficients c = core::solve_optimal_mis(a, fp, fq);
  EXPECT_NEAR(c.p, 3, 1e-12);
  EXPECT_NEAR(c.q, -2, 1e-12);
}

TEST(OptimalMis, EqualsTheBalanceHeuristicForEqualDensities) {
  const core::OptimalMisCoefficients c = core::solve_optimal_mis({0.25, 0.25, 0.25}, 1, 1);
  EXPECT_EQ(c.p, 0);
  EXPECT_EQ(c.q, 0);
}

/// Samples of a path with f / m = 2 + 5 p / m in red, twice that in green, at p / m of u and of 1 -
/// u: the radiance is 2 n + 5 x.
FitSample path_of(float u) {
  FitSample s;
  s.n = 2;
  for (const float t : {u, (1 - u) * (1 - u)}) {
    const Rgb f = Rgb{1, 2, 0} * (2 + 5 * t);
    s.x += t;
    s.xx += t * t;
    s.y += f;
    s.xy += f * t;
  }
  s.control = Rgb(s.x - 1);
  return s;
}

// f = a p + b q with a = 7 and b = 2 is f / m = 2 + 5 p / m. The control variate removes 5 (x - 1),
// apart from the regularisation towards 0.
TEST(ReplicateFit, OptimalWeightsSubtractTheDifferenceOfTheirCoefficients) {
  ReplicateFit sums;
  for (int i = 0; i < 1000; ++i) {
    sums.add(path_of(static_cast<float>(i) / 1000));
  }
  const Rgb c = core::fitted_coefficient(FitType::kOptimalMis, sums);
  EXPECT_NEAR(c.r, -5, 0.006);
  EXPECT_NEAR(c.g, -10, 0.012);
  EXPECT_EQ(c.b, 0);
}

ReplicateFit line(float slope, int count) {
  ReplicateFit sums;
  for (int i = 0; i < count; ++i) {
    const float x = static_cast<float>(i % 7) - 3;
    const float y = 4 + slope * x;
    sums.add({.control = Rgb(x), .n = 1, .x = x, .xx = x * x, .y = Rgb(y), .xy = Rgb(x * y)});
  }
  return sums;
}

TEST(ReplicateFit, RegressionFindsTheSlopeTimesVisibility) {
  EXPECT_NEAR(core::fitted_coefficient(FitType::kRegression, line(-0.5F, 7000)).g, 0.5F, 1e-3F);
  EXPECT_NEAR(core::fitted_coefficient(FitType::kRegression, line(-3, 7000)).g, 1, 1e-3F);
  EXPECT_EQ(core::fitted_coefficient(FitType::kRegression, line(2, 7000)).g, 0);
  EXPECT_NEAR(core::fitted_coefficient(FitType::kRegression, line(-1, 7)).g, 7.0F / 9, 1e-5F);
}

TEST(ReplicateFit, IsZeroWithoutSamples) {
  for (const FitType type : {FitType::kNone, FitType::kOptimalMis, FitType::kRegression}) {
    EXPECT_TRUE(core::is_black(core::fitted_coefficient(type, {})));
    ReplicateFit same;
    for (int i = 0; i < 9; ++i) {
      same.add({.control = {}, .n = 1, .x = 0, .xx = 0, .y = Rgb(1), .xy = {}});
    }
    EXPECT_TRUE(core::is_black(core::fitted_coefficient(type, same)));
  }
}

// Samples of one replicate change only its partner, and only the partner's later samples.
TEST(ReplicateFit, AppliesOnlyToThePartner) {
  const auto run = [](float first) {
    std::vector<ReplicateFit> fits(4);
    std::vector<float> out;
    for (std::uint32_t count = 0; count < 9; ++count) {
      for (std::size_t r = 0; r < 4; ++r) {
        core::PathSample s;
        s.fit = path_of(0.1F * static_cast<float>(count) + (count == 0 && r == 1 ? first : 0.05F));
        core::apply_fit(fits, r, count, FitType::kOptimalMis, s);
        out.push_back(s.radiance.r);
      }
    }
    return out;
  };
  const std::vector<float> a = run(0);
  const std::vector<float> b = run(0.5F);
  for (std::size_t i = 0; i < a.size(); ++i) {
    const bool later = i >= 4 * std::size_t{core::kFirstFit};
    EXPECT_EQ(a[i] != b[i], later && i % 4 == 0) << i;
  }
}

core::View small_view(bool regression) {
  core::View view = test_support::cornell_view(40, 36, 35);
  view.settings.film.filter = {core::FilterType::kMitchell, 2};
  view.settings.seed = 42;
  view.settings.max_depth = 2;
  if (regression) {
    view.settings.estimator.control_variate = core::ControlVariateType::kRegression;
  } else {
    view.settings.estimator.mis = core::MisType::kOptimal;
  }
  return view;
}

void go_on(const core::View& view, const std::shared_ptr<Film>& film, core::TaskOptions options,
           int threads) {
  core::NullSink sink;
  RenderTask task(renderer_of(view), film, std::move(options), sink);
  core::run_to_end(task, threads);
}

std::string digest_of(const core::View& view, core::TaskOptions options, int threads) {
  const auto film = make_film(view.settings);
  go_on(view, film, std::move(options), threads);
  return film->digest();
}

TEST(FittedBits, AreIndependentOfThreadsAndSliceLength) {
  for (const bool regression : {false, true}) {
    for (const core::AdaptiveType adaptive :
         {core::AdaptiveType::kNone, core::AdaptiveType::kPilot}) {
      core::View view = small_view(regression);
      view.settings.adaptive.type = adaptive;
      view.settings.adaptive.min_samples = 16;
      const std::string one = digest_of(view, samples(48), 1);
      EXPECT_EQ(digest_of(view, samples(48), 3), one) << regression;
      EXPECT_EQ(digest_of(view, samples(48, 1e-9), 2), one) << regression;
      core::View plain = view;
      plain.settings.estimator = {};
      EXPECT_NE(digest_of(plain, samples(48), 2), one) << regression;
    }
  }
}

TEST(FittedBits, AreIndependentOfRestartsAndExtensions) {
  for (const bool regression : {false, true}) {
    const core::View view = small_view(regression);
    const std::string whole = digest_of(view, samples(64), 2);
    auto film = make_film(view.settings);
    for (const int count : {6, 24, 40, 64}) {
      go_on(view, film, samples(count), 2);
      film = test_support::restored(*film);
    }
    EXPECT_EQ(film->digest(), whole) << regression;
    // The fit is part of the state: without it the film continues differently.
    film = make_film(view.settings);
    go_on(view, film, samples(24), 2);
    for (int t = 0; t < film->tile_count(); ++t) {
      core::TileState state = film->tile(t);
      state.fit.clear();
      film->restore(t, std::move(state), film->tile_revision(t));
    }
    go_on(view, film, samples(64), 2);
    EXPECT_NE(film->digest(), whole) << regression;
  }
}

// Needed to merge with replicates of other films.
TEST(FittedBits, OfAPairOfReplicatesAreIndependentOfTheOthers) {
  core::View view = small_view(false);
  const auto two = test_support::render(view, 40);
  view.settings.replicates = 4;
  const auto four = test_support::render(view, 80);
  for (std::size_t p = 0; p < two.snapshot.pixel_count(); ++p) {
    for (std::size_t r = 0; r < 2; ++r) {
      const core::ReplicatePixel& a = two.snapshot.pixels[2 * p + r];
      const core::ReplicatePixel& b = four.snapshot.pixels[4 * p + r];
      ASSERT_EQ(a.count, b.count);
      ASSERT_EQ(a.mean_g, b.mean_g);
      ASSERT_EQ(a.m2_luminance, b.m2_luminance);
    }
  }
}

TEST(FittedFilms, CountTheirMemory) {
  const core::View view = small_view(false);
  core::RenderSettings plain = view.settings;
  plain.estimator = {};
  EXPECT_EQ(make_film(view.settings)->bytes() - make_film(plain)->bytes(),
            40U * 36U * 2U * sizeof(ReplicateFit));
}

}  // namespace
