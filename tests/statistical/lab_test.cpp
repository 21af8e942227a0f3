// The laboratory: verdicts that can fail, runs that are reproducible and can be cancelled.

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>
#include <tuple>

#include <gtest/gtest.h>

#include "core/lab/fit.h"
#include "core/lab/plot.h"
#include "core/lab/run.h"
#include "core/lab/trial.h"
#include "tests/support/statistics.h"

namespace {

using namespace core::lab;  // NOLINT(google-build-using-namespace)
// Inside a TEST the plain name is a member of testing::Test.
using LabSetup = core::lab::Setup;

struct Done {
  std::vector<Point> points;
  Outcome outcome;
};

Done run_all(const Setup& setup, const RunOptions& options) {
  Done done;
  auto outcome = run(setup, options, {}, [&](const Point& point) {
    done.points.push_back(point);
    return true;
  });
  EXPECT_TRUE(outcome);
  done.outcome = *std::move(outcome);
  return done;
}

Setup setup_of(std::string_view experiment, std::string_view estimator,
               std::string_view sampler = "independent") {
  LabSetup setup = default_setup(*find_experiment(experiment));
  EXPECT_TRUE(choose_estimator(setup, estimator)) << estimator;
  EXPECT_TRUE(choose_sampler(setup, sampler)) << sampler;
  return setup;
}

TEST(Lab, HasTheDocumentedExperiments) {
  for (const char* name : {"pi",
                           "quadrature-d",
                           "strategies",
                           "mis-gamma",
                           "optimal-mis",
                           "rr-threshold",
                           "splitting",
                           "expected-values",
                           "control-variate",
                           "regression",
                           "antithetic",
                           "samplers-2d",
                           "samplers-4d",
                           "ris-m",
                           "reservoir-chi2",
                           "restir-1d",
                           "ppm-1d",
                           "stopping-bias",
                           "inversion",
                           "mse",
                           "infinite-variance",
                           "discrepancy",
                           "rendering-equation",
                           "path-integral",
                           "metropolis",
                           "density-estimation",
                           "irradiance-cache",
                           "reservoir-merge",
                           "roulette-efficiency"}) {
    EXPECT_NE(find_experiment(name), nullptr) << name;
  }
  EXPECT_EQ(experiments().size(), 29U);
}

TEST(Lab, EveryExperimentHasExplanations) {
  for (const Experiment* e : experiments()) {
    for (const std::string_view text :
         {e->title, e->summary, e->estimates, e->formula, e->look_for, e->unit}) {
      EXPECT_FALSE(text.empty()) << e->name;
    }
    EXPECT_FALSE(e->estimators.empty());
    EXPECT_GE(e->n.size(), 3U);
  }
}

/// Compares everything except times.
void expect_same_bits(const Done& a, const Done& b, std::string_view what) {
  ASSERT_EQ(a.points.size(), b.points.size());
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    const std::array<double, 4> x = {a.points[i].mean, a.points[i].rmse, a.points[i].standard_error,
                                     a.points[i].cost};
    const std::array<double, 4> y = {b.points[i].mean, b.points[i].rmse, b.points[i].standard_error,
                                     b.points[i].cost};
    EXPECT_EQ(std::memcmp(x.data(), y.data(), sizeof x), 0) << what;
  }
  EXPECT_EQ(a.outcome.slope, b.outcome.slope) << what;
  EXPECT_EQ(a.outcome.explanation, b.outcome.explanation) << what;
}

TEST(Lab, BitsAreIndependentOfTheNumberOfThreads) {
  for (const Experiment* e : experiments()) {
    const LabSetup setup = default_setup(*e);
    RunOptions options{.n = {e->n.front(), e->n[1]}, .replicates = 7, .seed = 3, .threads = 1};
    const Done one = run_all(setup, options);
    options.threads = 3;
    expect_same_bits(one, run_all(setup, options), e->name);
    options.seed = 4;
    if (e->name != "quadrature-d") {  // a product rule has no seed
      EXPECT_NE(run_all(setup, options).points[0].rmse, one.points[0].rmse) << e->name;
    }
  }
}

TEST(Lab, ResultDoesNotDependOnTheOtherSampleCounts) {
  const LabSetup setup = setup_of("pi", "hit");
  const Done both = run_all(setup, {.n = {64, 256}, .replicates = 8});
  const Done alone = run_all(setup, {.n = {256}, .replicates = 8});
  EXPECT_EQ(both.points[1].mean, alone.points[0].mean);
  EXPECT_FALSE(alone.outcome.slope) << "one point determines no slope";
}

TEST(Lab, StopsBetweenPointsWhenTheListenerIsGone) {
  int calls = 0;
  const auto outcome =
      run(setup_of("pi", "hit"), {.n = {16, 64, 256}, .replicates = 4}, {}, [&](const Point&) {
        ++calls;
        return false;
      });
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().code, core::ErrorCode::kCancelled);
  EXPECT_EQ(calls, 1);
}

TEST(Lab, StopsWithinATrialOfEveryExperiment) {
  // Each of these trials would run for minutes; the time limit of the test detects a failure.
  for (const Experiment* e : experiments()) {
    std::stop_source source;
    std::jthread later([&source] {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      source.request_stop();
    });
    const auto outcome =
        run(default_setup(*e), {.n = {kTrialMax}, .replicates = 1000, .threads = 2},
            source.get_token(), [](const Point&) { return true; });
    EXPECT_FALSE(outcome) << e->name;
  }
}

TEST(Lab, CountsTheEvaluationsOfAWholeRun) {
  EXPECT_EQ(total_evaluations(setup_of("pi", "hit"), {.n = {10, 100}, .replicates = 5}), 550);
  LabSetup ris = setup_of("ris-m", "ris");
  ris.parameters[0] = 32;
  EXPECT_EQ(total_evaluations(ris, {.n = {10}, .replicates = 5}), 1600);
}

TEST(Lab, RoundsSampleCountsAndReportsThem) {
  LabSetup setup = setup_of("quadrature-d", "midpoint");
  setup.parameters[0] = 3;
  const Done done = run_all(setup, {.n = {100}, .replicates = 2});
  EXPECT_EQ(done.points[0].n_asked, 100);
  EXPECT_EQ(done.points[0].n, 125);
}

// A synthetic experiment with an optional wrong expected value or theory.
constexpr std::array kUniform = {EstimatorInfo{"mean", "none", "The mean of uniform numbers."}};
constexpr std::array<std::int64_t, 3> kSomeN = {64, 256, 1024};

Experiment planted(double (*expected)(const Setup&),
                   std::optional<TheorySlope> (*slope)(const Setup&)) {
  Experiment e = *find_experiment("pi");
  e.estimators = kUniform;
  e.estimator = "mean";
  e.n = kSomeN;
  e.expected = expected;
  e.slope = slope;
  e.estimate = [](Trial& trial) {
    return mean_of(trial, [&] { return static_cast<double>(trial.get_4d(0).x); });
  };
  return e;
}

double half(const Setup& /*setup*/) { return 0.5; }
double half_and_two_percent(const Setup& /*setup*/) { return 0.51; }
std::optional<TheorySlope> root(const Setup& /*setup*/) { return TheorySlope{-0.5}; }
std::optional<TheorySlope> linear(const Setup& /*setup*/) { return TheorySlope{-1}; }

Verdict verdict_of(const Experiment& experiment, std::uint64_t seed = 1) {
  return run_all(default_setup(experiment), {.n = {64, 256, 1024}, .replicates = 64, .seed = seed})
      .outcome.verdict;
}

TEST(LabVerdict, AgreesWithTheTruth) {
  EXPECT_EQ(verdict_of(planted(&half, &root)), Verdict::kAgrees);
}
TEST(LabVerdict, DetectsTwoPercentTooMuch) {
  EXPECT_EQ(verdict_of(planted(&half_and_two_percent, &root)), Verdict::kDiffers);
}
TEST(LabVerdict, DetectsAWrongSlope) {
  EXPECT_EQ(verdict_of(planted(&half, &linear)), Verdict::kDiffers);
}

TEST(LabVerdict, DoesNotConfirmASlopeItCannotDetermine) {
  // Twelve replicates with similar n determine the slope so poorly that -0.5 and -1 would both be
  // consistent.
  const auto judged = [](std::optional<TheorySlope> (*slope)(const LabSetup&),
                         std::vector<std::int64_t> n, int replicates) {
    return run_all(default_setup(planted(&half, slope)),
                   {.n = std::move(n), .replicates = replicates})
        .outcome;
  };
  for (const auto slope : {&root, &linear}) {
    const core::lab::Outcome vague = judged(slope, {64, 128}, 12);
    EXPECT_EQ(vague.verdict, Verdict::kUndecided) << vague.explanation;
    EXPECT_NE(vague.explanation.find("too uncertain for a verdict"), std::string::npos)
        << vague.explanation;
  }
  EXPECT_EQ(judged(&root, {64, 1024}, 64).verdict, Verdict::kAgrees);
  EXPECT_EQ(judged(&linear, {64, 1024}, 64).verdict, Verdict::kDiffers);
}

TEST(LabVerdict, HasItsStatedFalseAlarmRate) {
  // Two checks of 0.1% each, that of the slope with an additional tolerance: 500 runs alarm at
  // most 1 time on average, more than 5 times with probability 0.0006 (Poisson).
  const Experiment experiment = planted(&half, &root);
  int alarms = 0;
  for (std::uint64_t seed = 1; seed <= 500; ++seed) {
    alarms += verdict_of(experiment, seed) == Verdict::kDiffers ? 1 : 0;
  }
  EXPECT_LE(alarms, 5);
}

TEST(LabFit, FitsTheLineThroughExactPoints) {
  std::vector<ErrorAt> points;
  for (const double n : {10.0, 100.0, 1000.0, 5000.0}) {
    points.push_back({n, 3 * std::pow(n, -0.75), 0.01});
  }
  const SlopeFit fit = fit_slope(points);
  EXPECT_NEAR(fit.slope, -0.75, 1e-12);
  EXPECT_NEAR(fit.intercept, std::log(3.0), 1e-12);
}

TEST(LabFit, SlopeIntervalsOfNoisyPointsCover) {
  // Errors of 32 normal replicates at four n, 2,000 times: the 95% interval contains -0.5 in 95%
  // of them; binomial standard error 0.5%, five of them allowed, and 1% for the delta method.
  test_support::Random random(5);
  int covered = 0;
  constexpr int kRuns = 2000;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<ErrorAt> points;
    for (const double n : {16.0, 64.0, 256.0, 1024.0}) {
      std::vector<double> squares;
      double sum = 0;
      for (int r = 0; r < 32; ++r) {
        const double error = random.normal() / std::sqrt(n);
        squares.push_back(error * error);
        sum += error * error;
      }
      points.push_back({n, std::sqrt(sum / 32), log_rmse_variance(squares)});
    }
    const SlopeFit fit = fit_slope(points);
    covered += std::fabs(fit.slope + 0.5) <= 2.04 * fit.standard_error
                   ? 1
                   : 0;  // t with 31 degrees of freedom
  }
  EXPECT_NEAR(static_cast<double>(covered) / kRuns, 0.95, 0.035);
}

/// Values of the replicates of the last run, which is on one thread.
std::vector<double>& last_values() {
  static std::vector<double> values;
  return values;
}

// The interval of a run is that of its fit, with one degree of freedom less than it has replicates.
TEST(LabFit, SlopeIntervalOfARunIsStudents) {
  Experiment experiment = planted(&half, &root);
  experiment.estimate = [](Trial& trial) {
    const double value = mean_of(trial, [&] { return static_cast<double>(trial.get_4d(0).x); });
    last_values().push_back(value);
    return value;
  };
  for (const auto& [replicates, quantile] : {std::pair(9, 2.306004), std::pair(16, 2.131450)}) {
    last_values().clear();
    const core::lab::Outcome outcome =
        run_all(default_setup(experiment), {.n = {64, 256, 1024}, .replicates = replicates})
            .outcome;
    const auto count = static_cast<std::size_t>(replicates);
    ASSERT_EQ(last_values().size(), 3 * count);
    std::vector<ErrorAt> points;
    for (const std::int64_t n : kSomeN) {
      std::vector<double> squares;
      double sum = 0;
      for (std::size_t r = 0; r < count; ++r) {
        const double off = last_values()[points.size() * count + r] - 0.5;
        squares.push_back(off * off);
        sum += off * off;
      }
      points.push_back(
          {static_cast<double>(n), std::sqrt(sum / replicates), log_rmse_variance(squares)});
    }
    const SlopeFit fit = fit_slope(points);
    ASSERT_TRUE(outcome.slope_interval);
    EXPECT_NEAR(*outcome.slope, fit.slope, 1e-12);
    EXPECT_NEAR(outcome.slope_interval->high - fit.slope, quantile * fit.standard_error, 1e-6);
    EXPECT_NEAR(fit.slope - outcome.slope_interval->low, quantile * fit.standard_error, 1e-6);
  }
}

TEST(LabVerdict, KeepsItsStatedErrorRateWithFewReplicates) {
  const LabSetup setup = setup_of("pi", "hit");
  int wrong = 0;
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    wrong += run_all(setup, {.n = {16, 64}, .replicates = 8, .seed = seed}).outcome.verdict ==
                     Verdict::kDiffers
                 ? 1
                 : 0;
  }
  EXPECT_LE(wrong, 9);  // more than 9 have a chance of 5e-5 at 0.2%
  for (int replicates = 2; replicates < 8; ++replicates) {
    EXPECT_EQ(run_all(setup, {.n = {16, 64}, .replicates = replicates}).outcome.verdict,
              Verdict::kUndecided);
  }
}

TEST(LabVerdict, OfQuadratureRulesIsCorrectInEveryDimension) {
  const std::vector<std::int64_t> n = {64, 256, 1024, 4096, 16384};
  for (const char* rule : {"midpoint", "simpson"}) {
    for (int d = 1; d <= 6; ++d) {
      LabSetup setup = setup_of("quadrature-d", rule);
      setup.parameters[0] = d;
      const Outcome outcome = run_all(setup, {.n = n, .replicates = 8}).outcome;
      EXPECT_EQ(outcome.verdict, Verdict::kAgrees)
          << rule << " in " << d << ": " << outcome.explanation;
    }
  }
}

TEST(LabVerdict, OfSimpsonsRuleHandlesErrorsFarBelowFloatPrecision) {
  LabSetup setup = setup_of("quadrature-d", "simpson");
  setup.parameters[0] = 1;
  // Errors start at 2e-7: pi^4 h^4 / 180.
  const Outcome outcome = run_all(setup, {.n = {41, 81, 161, 321}, .replicates = 8}).outcome;
  ASSERT_TRUE(outcome.slope);
  EXPECT_NEAR(*outcome.slope, -4, 0.1);  // k/(k - 1) of 4 at k = 41
}

TEST(LabPlot, ShowsEveryPointAndBothLines) {
  const LabSetup setup = setup_of("pi", "hit");
  const Done done = run_all(setup, {.n = {16, 64, 256}, .replicates = 16});
  const std::string svg = plot_svg(setup, done.points, done.outcome);
  std::size_t circles = 0;
  for (std::size_t at = svg.find("<circle"); at != std::string::npos;
       at = svg.find("<circle", at + 1)) {
    ++circles;
  }
  EXPECT_EQ(circles, 3U);
  EXPECT_NE(svg.find("class=\"fitted\""), std::string::npos);
  EXPECT_NE(svg.find("class=\"expected\""), std::string::npos);
  const std::string csv = points_csv(done.points);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 4);
  EXPECT_EQ(csv.substr(0, csv.find('\n')), "n,mean,rmse,standard_error,cost,seconds");
}

TEST(LabPlot, DrawsThePointsOfASamplerForEachPairOfAxes) {
  for (const auto& [name, estimator, squares] :
       {std::tuple{"samplers-2d", "smooth", 1}, {"samplers-4d", "ball", 6}}) {
    const LabSetup setup = setup_of(name, estimator);
    const Done done = run_all(setup, {.n = {16, 64}, .replicates = 4});
    const std::string svg = plot_svg(setup, done.points, done.outcome);
    int found = 0;
    for (std::size_t at = svg.find("class=\"points\""); at != std::string::npos;
         at = svg.find("class=\"points\"", at + 1)) {
      const std::string dots = svg.substr(at, svg.find("\"/>", at) - at);
      EXPECT_EQ(std::count(dots.begin(), dots.end(), 'M'), 64) << name;
      ++found;
    }
    EXPECT_EQ(found, squares) << name;
  }
}

TEST(LabPlot, StatesThatThereIsNoErrorToPlot) {
  LabSetup setup = setup_of("control-variate", "control-variate");
  Outcome outcome;
  outcome.expected = 1;
  const std::vector<Point> points = {{.n_asked = 4, .n = 4, .mean = 1}};
  EXPECT_NE(plot_svg(setup, points, outcome).find("exact"), std::string::npos);
}

}  // namespace
