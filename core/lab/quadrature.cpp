// Product rules versus Monte Carlo in d dimensions: the curse of dimensionality.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/lab/experiment_list.h"
#include "core/lab/trial.h"

namespace core::lab {
namespace {

enum { kMidpoint, kSimpson, kMonteCarlo };
enum { kDimensions };

constexpr int kDimensionsMax = 10;
constexpr std::array kEstimators = {
    EstimatorInfo{"midpoint", "consistent",
                  "Product of midpoint rules with k nodes per axis; deterministic."},
    EstimatorInfo{"simpson", "consistent",
                  "Product of Simpson's rules with k nodes per axis; deterministic."},
    EstimatorInfo{"monte-carlo", "none", "Mean over n points of the sampler."},
};
constexpr std::array kParameters = {
    ParameterInfo{"dimensions", 1, kDimensionsMax, 2, true, "Dimensions d of the cube."},
};
constexpr std::array<std::int64_t, 6> kN = {64, 256, 1024, 4096, 16384, 65536};

double expected(const Setup& /*setup*/) { return 1; }

std::optional<TheorySlope> slope(const Setup& setup) {
  const double d = setup.parameter(kDimensions);
  switch (setup.estimator) {
    case kMidpoint:
      return TheorySlope{-2 / d, 0.1};
    case kSimpson:
      // k nodes are k - 1 intervals: from 3 to 5 nodes the error still falls as n^(-6/d).
      return TheorySlope{-4 / d, 2 / d + 0.1};
    default:
      return monte_carlo_slope(setup);
  }
}

/// Returns k such that k^d is nearest to n, at least 2; odd for Simpson, at least 3.
std::int64_t nodes(const Setup& setup, std::int64_t n) {
  const double k = std::pow(static_cast<double>(n), 1 / setup.parameter(kDimensions));
  if (setup.estimator == kSimpson) {
    return std::max<std::int64_t>(3, 2 * std::llround((k - 1) / 2) + 1);
  }
  return std::max<std::int64_t>(2, std::llround(k));
}

std::int64_t rounded(const Setup& setup, std::int64_t n) {
  if (setup.estimator == kMonteCarlo) {
    return n;
  }
  const std::int64_t k = nodes(setup, n);
  std::int64_t total = 1;
  for (int i = 0; i < setup.whole(kDimensions); ++i) {
    total *= k;
  }
  return total;
}

double f(double x) { return 0.5 * std::numbers::pi * std::sin(std::numbers::pi * x); }

/// Returns the rule of one axis times the integrand: weight * f at node j of k.
double weighted(std::size_t estimator, std::int64_t j, std::int64_t k) {
  const auto count = static_cast<double>(k);
  if (estimator == kMidpoint) {
    return f((static_cast<double>(j) + 0.5) / count) / count;
  }
  const double h = 1 / (count - 1);
  const double weight = j == 0 || j == k - 1 ? 1 : (j % 2 == 1 ? 4 : 2);
  return weight * h / 3 * f(static_cast<double>(j) * h);
}

/// Sums over all k^d nodes without using that the integrand is a product.
double product_rule(Trial& trial) {
  const int d = trial.whole(kDimensions);
  const std::int64_t k = nodes(trial.setup(), trial.n());
  double sum = 0;
  for (std::int64_t i = 0; i < trial.n(); ++i) {
    if (!trial.start(i)) {
      return 0;
    }
    double term = 1;
    std::int64_t rest = i;
    for (int axis = 0; axis < d; ++axis) {
      term *= weighted(trial.estimator(), rest % k, k);
      rest /= k;
    }
    sum += term;
  }
  return sum;
}

double estimate(Trial& trial) {
  if (trial.estimator() != kMonteCarlo) {
    return product_rule(trial);
  }
  const int d = trial.whole(kDimensions);
  return mean_of(trial, [&] {
    double product = 1;
    for (int group = 0; 4 * group < d; ++group) {
      const Vec4 u = trial.get_4d(group);
      const std::array<float, 4> x = {u.x, u.y, u.z, u.w};
      for (int axis = 4 * group; axis < std::min(d, 4 * group + 4); ++axis) {
        product *= f(x[static_cast<std::size_t>(axis % 4)]);
      }
    }
    return product;
  });
}

}  // namespace

const Experiment kQuadratureExperiment = {
    .name = "quadrature-d",
    .title = "Quadrature versus Monte Carlo",
    .summary =
        "Grid rules win in few dimensions; the rate of Monte Carlo does not depend on the number "
        "of dimensions.",
    .estimates = "The integral over the d-dimensional unit cube of Π (π/2) sin(π xᵢ), which is 1.",
    .formula = "midpoint error ~ n^(−2/d),  Simpson ~ n^(−4/d),  Monte Carlo ~ n^(−1/2)",
    .look_for =
        "Increase d. The midpoint rule has the same slope as Monte Carlo at d = 4, Simpson's rule "
        "at d = 8; in higher dimensions a grid is worse. A light path has two or more dimensions "
        "per bounce.",
    .estimators = kEstimators,
    .parameters = kParameters,
    .estimator = "midpoint",
    .n = kN,
    .unit = "nodes",
    .expected = &expected,
    .slope = &slope,
    .rounded = &rounded,
    .estimate = &estimate,
};

}  // namespace core::lab
