// The experiments of the course on theory: their wrong twins, and closed forms of their errors.
// Seeds are fixed; each test states the chance that a correct laboratory would fail it with another
// seed.

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/integrators/maps/photon_rules.h"
#include "core/lab/run.h"

namespace {

using namespace core::lab;  // NOLINT(google-build-using-namespace)
// Inside a TEST the plain name is a member of testing::Test.
using LabSetup = core::lab::Setup;

constexpr const char* kLessons[] = {"inversion",          "mse",
                                    "infinite-variance",  "discrepancy",
                                    "rendering-equation", "path-integral",
                                    "metropolis",         "density-estimation",
                                    "irradiance-cache",   "reservoir-merge",
                                    "roulette-efficiency"};

Setup setup_of(std::string_view experiment, std::string_view estimator) {
  LabSetup setup = default_setup(*find_experiment(experiment));
  EXPECT_TRUE(choose_estimator(setup, estimator)) << estimator;
  return setup;
}

void set(LabSetup& setup, std::string_view name, double value) {
  for (std::size_t i = 0; i < setup.parameters.size(); ++i) {
    if (setup.experiment->parameters[i].name == name) {
      setup.parameters[i] = value;
      return;
    }
  }
  ADD_FAILURE() << name;
}

Outcome outcome_of(const LabSetup& setup, std::vector<std::int64_t> n = {}, int replicates = 64) {
  if (n.empty()) {
    n.assign(setup.experiment->n.begin(), setup.experiment->n.end());
  }
  auto out = run(setup, {.n = n, .replicates = replicates, .seed = 2, .threads = 2}, {},
                 [](const Point&) { return true; });
  EXPECT_TRUE(out);
  return *std::move(out);
}

Point point_of(const LabSetup& setup, std::int64_t n, int replicates = 1024) {
  Point out;
  EXPECT_TRUE(run(setup, {.n = {n}, .replicates = replicates, .seed = 3, .threads = 2}, {},
                  [&](const Point& p) {
                    out = p;
                    return true;
                  }));
  return out;
}

TEST(LabLessons, EveryVerdictRefusesTheWrongTwinAndAcceptsTheRest) {
  // A false "differs" has a chance of 0.2% each, about 40 estimators.
  for (const char* name : kLessons) {
    const Experiment& e = *find_experiment(name);
    int twins = 0;
    for (const EstimatorInfo& estimator : e.estimators) {
      const Outcome out = outcome_of(setup_of(name, estimator.name));
      if (estimator.bias == "biased") {
        ++twins;
        EXPECT_EQ(out.verdict, Verdict::kBiased) << name << " " << estimator.name;
      } else {
        EXPECT_NE(out.verdict, Verdict::kDiffers)
            << name << " " << estimator.name << ": " << out.explanation;
      }
      if (estimator.bias == "none") {
        EXPECT_EQ(out.verdict, Verdict::kAgrees)
            << name << " " << estimator.name << ": " << out.explanation;
      }
    }
    EXPECT_GE(twins, 1) << name;
  }
}

/// Ratio of measured and predicted mean squared error: 1,024 replicates of nearly normal errors
/// have a relative standard error of sqrt(2 / 1024) = 4.4%; five of them.
void expect_mse(const LabSetup& setup, std::int64_t n, double mse) {
  const Point p = point_of(setup, n);
  EXPECT_NEAR(p.rmse * p.rmse / mse, 1, 0.22)
      << setup.experiment->name << " " << setup.estimator_name();
}

TEST(LabLessons, ErrorsMatchTheirClosedForms) {  // false alarm below 1e-5 in total
  using std::numbers::pi;
  // Normal samples, n = 16: 2/(n - 1), (2n - 1)/n^2, 2/(n + 1).
  expect_mse(setup_of("mse", "unbiased"), 16, 2.0 / 15);
  expect_mse(setup_of("mse", "by-n"), 16, 31.0 / 256);
  expect_mse(setup_of("mse", "least-mse"), 16, 2.0 / 17);
  expect_mse(setup_of("mse", "first-16"), 1024, 2.0 / 15);
  // Chi-squared with 63 degrees of freedom.
  expect_mse(setup_of("inversion", "disk"), 4096, 2.0 / 63);
  // E T^2 of independent points.
  expect_mse(setup_of("discrepancy", "discrepancy"), 256, (1.0 / 4 - 1.0 / 9) / 256);
  // Uniform directions: (rho/pi)^2 (4 pi^2 E[V cos^2] - E^2), without the plate E[cos^2] = 1/3.
  LabSetup open = setup_of("rendering-equation", "hemisphere");
  set(open, "plate", 0);
  expect_mse(open, 1024, 0.25 * (4.0 / 3 - 1) / 1024);
  // All of a path by chance: albedo with the probability I / albedo.
  LabSetup plates = setup_of("path-integral", "s0-t3");
  const double power = plates.experiment->expected(plates);
  expect_mse(plates, 4096, power * (0.8 - power) / 4096);
  // Photons within r: p / (n pi r^2) with p = 3/4 (1 + r^2), bias 3/4 r^2.
  const double area = pi / 16;
  const double mean = 0.75 * (1 + 1.0 / 16);
  expect_mse(setup_of("density-estimation", "fixed"), 256,
             (mean / area - mean * mean) / 256 + std::pow(0.75 / 16, 2));
  // Walks: V = V[N] mu^2/c^2 / (1 - m/c); at c = 1 V[N] = 1/4, so V = 2. Constant q = 3/4.
  LabSetup walks = setup_of("roulette-efficiency", "proportional");
  set(walks, "factor", 1);
  expect_mse(walks, 1024, 2.0 / 1024);
  expect_mse(setup_of("roulette-efficiency", "constant"), 1024, (3 / (1 - 0.41 / 0.75) - 4) / 1024);
}

TEST(LabLessons, CostsOfWalksAreThoseOfBranchingProcesses) {
  // 1 / (1 - c m) surfaces; 1,024 replicates of 1,024 walks, standard error below 0.1%.
  EXPECT_NEAR(point_of(setup_of("roulette-efficiency", "proportional"), 1024).cost / 1024,
              1 / (1 - 0.55), 0.02);
  EXPECT_NEAR(point_of(setup_of("roulette-efficiency", "constant"), 1024).cost / 1024, 4, 0.03);
}

void expect_mean(const LabSetup& setup, std::int64_t n, double mean) {
  const Point p = point_of(setup, n, 256);
  EXPECT_NEAR(p.mean, mean, 4 * p.standard_error)
      << setup.experiment->name << " " << setup.estimator_name();
}

TEST(LabLessons, BiasesMatchTheirPredictions) {  // four standard errors each
  expect_mean(setup_of("mse", "forgotten"), 256, 2);
  expect_mean(setup_of("density-estimation", "fixed"), 4096, 0.75 * (1 + 1.0 / 16));
  expect_mean(setup_of("density-estimation", "edge"), 4096, 1);
  // The root of 3x^2 has the density 2x, of mean 2/3.
  expect_mean(setup_of("metropolis", "no-balance"), 4096, 2.0 / 3);
  // Four times the exact value without weights.
  const LabSetup sum = setup_of("path-integral", "unweighted");
  expect_mean(sum, 4096, 4 * sum.experiment->expected(sum));
  // Without the plate: floor 1/4 + 1/2. No plate, no visibility term.
  LabSetup open = setup_of("rendering-equation", "no-visibility");
  set(open, "plate", 0);
  expect_mean(open, 4096, 0.75);
  // 1 + ... of four surfaces, 2 (1 - 2^-4); without 1/q the mean albedo is halved by q.
  expect_mean(setup_of("roulette-efficiency", "cut-off"), 1024, 2 - 0.125);
  expect_mean(setup_of("roulette-efficiency", "forgotten"), 1024, 1 / (1 - 0.375));
}

TEST(LabLessons, ChainsAcceptAndMoveAsIntegralsOfTheTargetSay) {
  // Fresh numbers: the integrals of min(f(x), f(y)) and of (y - x)^2 times it, for f = 3x^2.
  LabSetup accepted = setup_of("metropolis", "acceptance");
  LabSetup jump = setup_of("metropolis", "jump");
  set(accepted, "large", 1);
  set(jump, "large", 1);
  expect_mean(accepted, 4096, 0.5);
  expect_mean(jump, 4096, 1.0 / 30);
  // Every second mutation is a small step of at most 1/2, around the ends: mean over d of
  // (1 - d)^3 + d^3 is 1/2, and of d^2 times it 1/12 - 3/32 + 3/80.
  for (LabSetup* setup : {&accepted, &jump}) {
    set(*setup, "large", 0.5);
    set(*setup, "step", 0.5);
  }
  expect_mean(accepted, 4096, 0.5);
  expect_mean(jump, 4096, (1.0 / 30 + 1.0 / 12 - 3.0 / 32 + 3.0 / 80) / 2);
}

TEST(LabLessons, PathIntegralHasTheFormFactorsOfTheCrossedStrings) {
  // Hottel: F of the plates is sqrt(2) - 1; by Jensen the mean of F^2 is at least its square.
  LabSetup setup = setup_of("path-integral", "all");
  set(setup, "albedo", 1);
  const double factor = std::numbers::sqrt2 - 1;
  const double power = setup.experiment->expected(setup);
  EXPECT_GT(power, factor * factor);
  EXPECT_LT(power, 1.02 * factor * factor);  // F(b) is within 11% of its mean
}

TEST(LabLessons, ClassicalIntervalsFailForEverySampleCount) {
  // Of 2,048 intervals at each n, a share of 95% has a standard error of 0.5%.
  for (const std::int64_t n : {128, 2048}) {
    EXPECT_LT(point_of(setup_of("infinite-variance", "classical"), n, 128).mean, 0.9) << n;
    EXPECT_NEAR(point_of(setup_of("infinite-variance", "matched"), n, 128).mean, 0.95, 0.025) << n;
  }
  EXPECT_GT(point_of(setup_of("infinite-variance", "grain-and-doubt"), 128, 64).mean, 0.95);
}

TEST(LabLessons, MergingTwoReservoirsIsOneOfTwiceTheCandidates) {
  LabSetup twice = setup_of("reservoir-merge", "own");
  set(twice, "candidates", 8);
  const double own = point_of(setup_of("reservoir-merge", "own"), 1024).rmse;
  const double two = point_of(setup_of("reservoir-merge", "two"), 1024).rmse;
  // Errors of 1,024 replicates have standard errors of 2.2%; five of their difference.
  EXPECT_NEAR(two / point_of(twice, 1024).rmse, 1, 0.16);
  EXPECT_LT(two, 0.9 * own);
}

TEST(LabLessons, GradientsRemoveMostOfTheBiasOfRecords) {
  const auto bias = [](std::string_view estimator) {
    const LabSetup setup = setup_of("irradiance-cache", estimator);
    return std::fabs(point_of(setup, 4096, 16).mean - setup.experiment->expected(setup));
  };
  EXPECT_LT(bias("gradients"), 0.5 * bias("records"));
}

TEST(LabLessons, PhotonsHaveTheRadiiOfTheRenderer) {
  // The mean of the photons' radii squared, by the renderer's rule, predicts the bias 3/4 r^2.
  double squares = 0;
  for (int i = 0; i < 64; ++i) {
    squares += std::pow(0.25 * core::sppm_radius(2.0F / 3, i), 2) / 64;
  }
  const Point p = point_of(setup_of("density-estimation", "progressive"), 64, 4096);
  EXPECT_NEAR(p.mean - 0.75, 0.75 * squares, 4 * p.standard_error);
}

}  // namespace
