// Each experiment against closed forms: exact value, variance, bias, slope. Seeds are fixed; each
// test states the chance that a correct laboratory would fail it with another seed.

#include <array>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/base/statistics.h"
#include "core/lab/run.h"
#include "core/lab/stage.h"
#include "tests/support/statistics.h"

namespace {

using namespace core::lab;  // NOLINT(google-build-using-namespace)
// Inside a TEST the plain name is a member of testing::Test.
using LabSetup = core::lab::Setup;

struct Parameter {
  const char* name;
  double value;
};

Setup setup_of(std::string_view experiment, std::string_view estimator,
               std::vector<Parameter> parameters = {}) {
  LabSetup setup = default_setup(*find_experiment(experiment));
  EXPECT_TRUE(choose_estimator(setup, estimator)) << estimator;
  EXPECT_TRUE(choose_sampler(setup, "independent"));
  for (const Parameter& p : parameters) {
    bool found = false;
    for (std::size_t i = 0; i < setup.parameters.size(); ++i) {
      if (setup.experiment->parameters[i].name == p.name) {
        setup.parameters[i] = p.value;
        found = true;
      }
    }
    EXPECT_TRUE(found) << p.name;
  }
  return setup;
}

Point one_n(const Setup& setup, std::int64_t n, int replicates, std::uint64_t seed = 1) {
  Point out;
  EXPECT_TRUE(run(setup, {.n = {n}, .replicates = replicates, .seed = seed, .threads = 2}, {},
                  [&](const Point& p) {
                    out = p;
                    return true;
                  }));
  return out;
}

double expected_of(const Setup& setup) { return setup.experiment->expected(setup); }

TEST(LabTruth, ExpectedValuesMatchTheClosedForms) {
  EXPECT_NEAR(expected_of(setup_of("pi", "hit")), 3.14159265358979, 1e-14);
  // Irradiance from a unit square at distance 1, and E = pi for one that fills the hemisphere.
  EXPECT_NEAR(expected_of(setup_of("strategies", "area")), 0.7522747, 1e-7);
  EXPECT_NEAR(rectangle_irradiance(-1e4, 1e4, -1e4, 1e4), std::numbers::pi, 1e-3);
  // Half of a centred square gives half of its light.
  EXPECT_NEAR(expected_of(setup_of("control-variate", "plain", {{"side", 1}, {"hidden", 0.5}})),
              0.7522747 / 2, 1e-7);
  EXPECT_NEAR(expected_of(setup_of("regression", "plain")), 0.78539816, 1e-8);
  EXPECT_NEAR(expected_of(setup_of("samplers-4d", "ball")), 0.30842514, 1e-8);
}

/// Variance of a single evaluation from 4,096 replicates of 64: its relative standard error is at
/// most sqrt((k - 1) / 4096), k the kurtosis of the mean, below 3.2 here, so 2.3%; five of them.
void expect_variance(const Setup& setup, double variance) {
  constexpr std::int64_t kN = 64;
  const Point point = one_n(setup, kN, 4096);
  EXPECT_NEAR(point.rmse * point.rmse * static_cast<double>(point.n) / variance, 1, 0.115)
      << setup.experiment->name << " " << setup.estimator_name();
}

TEST(LabTruth, VariancesMatchTheFormulas) {  // false alarm below 1e-5 in total
  using std::numbers::pi;
  expect_variance(setup_of("pi", "hit"), 1.642183 * 1.642183);
  expect_variance(setup_of("pi", "height"), 0.892783 * 0.892783);
  // (pi^2 / 8)^d - 1.
  expect_variance(setup_of("quadrature-d", "monte-carlo", {{"dimensions", 2}}),
                  pi * pi * pi * pi / 64 - 1);
  // Cosine sampling: pi with probability E / pi.
  constexpr double kE = 0.7522747;
  expect_variance(setup_of("strategies", "cosine"), kE * (pi - kE));
  expect_variance(setup_of("strategies", "bsdf"), kE * (pi - kE));
  expect_variance(setup_of("expected-values", "absorption", {{"albedo", 0.5}}),
                  0.25 * kE * (pi - kE));
  expect_variance(setup_of("expected-values", "analog", {{"albedo", 0.5}}), kE / 2 * (pi - kE / 2));
  // t = 4 u^3, visible half of the time: E[X^2] = 8/7; roulette divides it by q.
  expect_variance(setup_of("rr-threshold", "none"), 8.0 / 7 - 0.25);
  expect_variance(setup_of("rr-threshold", "throughput", {{"probability", 0.5}}), 16.0 / 7 - 0.25);
  // q = min(1, t / d): E = 1/2 (16/7 (1 - c^7) + d c^4), where t < d for u < c = (d/4)^(1/3).
  const double c = std::cbrt(0.5 / 4);
  expect_variance(setup_of("rr-threshold", "threshold", {{"delta", 0.5}}),
                  0.5 * (16.0 / 7 * (1 - std::pow(c, 7)) + 0.5 * std::pow(c, 4)) - 0.25);
  // 1/3 + 4/9 / s.
  expect_variance(setup_of("splitting", "none"), 7.0 / 9);
  expect_variance(setup_of("splitting", "fixed", {{"copies", 8}}), 1.0 / 3 + 4.0 / 72);
  // Pairs: 0.0039125 per pair, so twice that per evaluation; for the even function twice as much as
  // plain.
  expect_variance(setup_of("antithetic", "plain"), 0.2420351);
  expect_variance(setup_of("antithetic", "pairs"), 2 * 0.0039125);
  expect_variance(setup_of("antithetic", "plain", {{"integrand", 1}}), 1.0 / 180);
  expect_variance(setup_of("antithetic", "pairs", {{"integrand", 1}}), 2.0 / 180);
  // One candidate is plain importance sampling.
  const double visible = expected_of(setup_of("ris-m", "ris", {{"candidates", 1}}));
  expect_variance(setup_of("ris-m", "ris", {{"candidates", 1}}), visible * (pi - visible));
}

TEST(LabTruth, CostOfRouletteIsThatOfTheTracedRays) {
  // E[cost] = 1 + 10 q; the mean q of the threshold is c^4 / d + 1 - c (4 u^3 / d below c).
  const double c = std::cbrt(0.5 / 4);
  const double q = c * c * c * c / 0.5 + 1 - c;
  EXPECT_NEAR(one_n(setup_of("rr-threshold", "threshold", {{"delta", 0.5}}), 4096, 64).cost / 4096,
              1 + 10 * q, 0.05);
  EXPECT_EQ(one_n(setup_of("rr-threshold", "none"), 64, 4).cost, 64 * 11);
}

TEST(LabTruth, ControlVariateIsExactWithoutOcclusion) {
  const LabSetup setup = setup_of("control-variate", "control-variate", {{"hidden", 0}});
  const Point point = one_n(setup, 64, 64);
  EXPECT_LT(point.rmse / expected_of(setup), 1e-5);
}

TEST(LabTruth, RegressionOnItsOwnSamplesHasTheIndependentlyMeasuredBias) {
  // Computed independently: +3.7% and -28% at N = 8. 20,000 replicates: standard errors 0.13%
  // and 1.2%, four of them.
  for (const auto& [integrand, bias, reach] :
       {std::array{0.0, 0.037, 0.006}, std::array{1.0, -0.28, 0.05}}) {
    double sum = 0;
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const LabSetup setup = setup_of("regression", "same-samples", {{"integrand", integrand}});
      sum += one_n(setup, 8, 4000, seed).mean / expected_of(setup) - 1;
    }
    EXPECT_NEAR(sum / 5, bias, reach);
  }
}

TEST(LabTruth, StopRulesHaveTheIndependentlyMeasuredBias) {
  // Simulated independently with 200,000 trials; here 65,536: the standard error of a mean is below
  // 1%, five of them. Pilots of cross-half have 32 samples in each half here.
  const auto bias = [](std::string_view rule, double distribution) {
    return one_n(setup_of("stopping-bias", rule, {{"distribution", distribution}}), 1024, 64).mean -
           1;
  };
  EXPECT_NEAR(bias("half-metric", 0), -0.48, 0.05);
  EXPECT_NEAR(bias("standard-error", 0), -0.71, 0.05);
  EXPECT_NEAR(bias("pilot-reused", 0), -0.51, 0.05);
  EXPECT_NEAR(bias("standard-error", 2), 0.020, 0.01);
  EXPECT_LT(bias("cross-counts", 0), -0.2);
  EXPECT_NEAR(bias("pilot-discarded", 0), 0, 0.05);
  EXPECT_NEAR(bias("cross-half", 0), 0, 0.05);
}

TEST(LabTruth, ProgressiveDensityHasTheBiasOfItsRadii) {
  // Mean of r_i^2; 4,096 replicates of 16 passes, four standard errors.
  const LabSetup setup = setup_of("ppm-1d", "progressive");
  double radius = 0.25;
  double bias = 0;
  for (int i = 1; i <= 16; ++i) {
    bias += radius * radius / 16;
    radius *= (i + 2.0 / 3) / (i + 1);
  }
  const Point point = one_n(setup, 16, 4096);
  EXPECT_NEAR(point.mean - 0.75, bias, 4 * point.standard_error);
  const Point fixed = one_n(setup_of("ppm-1d", "fixed"), 256, 1024);
  EXPECT_NEAR(fixed.mean - 0.75, 0.0625, 4 * fixed.standard_error);
}

TEST(LabTruth, CountingInvisibleStreamsDarkens) {
  // Without MIS weights the streams of pixels in deeper shadow also count: pixel 8 (x = 8.5/16)
  // loses much of its light.
  const LabSetup setup = setup_of("restir-1d", "biased");
  const Point point = one_n(setup, 1024, 64);
  EXPECT_LT(point.mean, expected_of(setup) - 10 * point.standard_error);
}

TEST(LabTruth, ReuseReducesTheErrorOfAFrame) {
  const auto rmse = [](std::string_view estimator) {
    return one_n(setup_of("restir-1d", estimator), 1024, 256).rmse;
  };
  const double alone = rmse("ris");
  EXPECT_LT(rmse("spatial"), 0.9 * alone);
  EXPECT_LT(rmse("temporal"), 0.6 * alone);
}

TEST(LabTruth, UnbiasedEstimatorsAreUnbiasedWithEverySampler) {
  // All estimators of bias "none", with every sampler they accept, z-tests by Student's t at the
  // Sidak level of 0.1% in total.
  struct Case {
    LabSetup setup;
    Point point;
  };
  std::vector<Case> cases;
  for (const Experiment* e : experiments()) {
    for (const std::string_view sampler : allowed_samplers(*e)) {
      for (std::size_t k = 0; k < e->estimators.size(); ++k) {
        if (e->estimators[k].bias == "none") {
          LabSetup setup = default_setup(*e);
          setup.estimator = k;
          ASSERT_TRUE(choose_sampler(setup, sampler));
          cases.push_back({setup, one_n(setup, e->n[2], 64, 11)});
        }
      }
    }
  }
  const double alpha = test_support::sidak(1e-3, static_cast<int>(cases.size()));
  const double limit = core::student_t_quantile(1 - alpha / 2, 63);
  for (const Case& c : cases) {
    const double off = std::fabs(c.point.mean - expected_of(c.setup));
    EXPECT_LT(off, limit * c.point.standard_error + 1e-6)
        << c.setup.experiment->name << " " << c.setup.estimator_name() << " "
        << c.setup.sampler_name;
  }
}

TEST(LabTruth, EstimatorsLabelledBiasedAreBiased) {
  for (const Experiment* e : experiments()) {
    for (std::size_t k = 0; k < e->estimators.size(); ++k) {
      if (e->estimators[k].bias == "biased") {
        LabSetup setup = default_setup(*e);
        setup.estimator = k;
        const Point point = one_n(setup, e->n.back(), 64, 11);
        EXPECT_GT(std::fabs(point.mean - expected_of(setup)), 6 * point.standard_error)
            << e->name << " " << setup.estimator_name();
      }
    }
  }
}

TEST(LabTruth, SlopesOfEverySamplerMatchTheory) {
  // Every estimator and sampler for which theory gives a slope; a false "differs" has a chance of
  // 0.2% each.
  int compared = 0;
  for (const char* name :
       {"pi", "quadrature-d", "samplers-2d", "samplers-4d", "ppm-1d", "antithetic"}) {
    const Experiment& e = *find_experiment(name);
    for (const std::string_view sampler : allowed_samplers(e)) {
      for (std::size_t k = 0; k < e.estimators.size(); ++k) {
        LabSetup setup = default_setup(e);
        setup.estimator = k;
        ASSERT_TRUE(choose_sampler(setup, sampler));
        if (!e.slope(setup)) {
          continue;
        }
        ++compared;
        const auto outcome =
            run(setup, {.n = {e.n.begin(), e.n.end()}, .replicates = 64, .seed = 5, .threads = 2},
                {}, [](const Point&) { return true; });
        ASSERT_TRUE(outcome);
        EXPECT_NE(outcome->verdict, Verdict::kDiffers)
            << name << " " << setup.estimator_name() << " " << sampler << ": "
            << outcome->explanation;
      }
    }
  }
  EXPECT_GE(compared, 20);
}

}  // namespace
