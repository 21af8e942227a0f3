// The discrepancy of point sets in the square, and the error that it bounds.

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/lab/experiment_list.h"
#include "core/lab/trial.h"

namespace core::lab {
namespace {

enum { kDiscrepancy, kError, kExcess, kClumped };

constexpr std::array kEstimators = {
    EstimatorInfo{"discrepancy", "consistent",
                  "The L2 star discrepancy T: how far the share of points in [0,a) x [0,b) is from "
                  "its area."},
    EstimatorInfo{"error", "consistent", "|mean of f - 1/4| for f = (1 - x)(1 - y)."},
    EstimatorInfo{"excess", "none",
                  "The part of that error above the bound T: 0 for every set of points."},
    EstimatorInfo{"clumped", "biased",
                  "Deliberately wrong: the same points squeezed into [0, 0.9)^2."},
};
constexpr std::array<std::int64_t, 4> kN = {16, 64, 256, 1024};

double expected(const Setup& /*setup*/) { return 0; }
/// T compares all pairs of points.
double evaluations(const Setup& setup, std::int64_t n) {
  return static_cast<double>(n) * (setup.estimator == kError ? 1.0 : static_cast<double>(n));
}

/// Independent points: E T^2 = (2^-d - 3^-d) / n. Others: the variance of the share of points in a
/// box is that of the cells or intervals at its border.
std::optional<TheorySlope> slope(const Setup& setup) {
  const std::string_view s = setup.sampler_name;
  if (setup.estimator >= kExcess) {
    return std::nullopt;
  }
  if (s == "independent" || s == "antithetic" || s == "zsobol") {
    return TheorySlope{-0.5};
  }
  if (setup.estimator == kError) {
    return s == "sobol" ? std::optional(TheorySlope{-1.5, 0.2}) : std::nullopt;
  }
  if (s == "stratified") {
    return TheorySlope{-0.75};
  }
  return s == "sobol" ? std::optional(TheorySlope{-1, 0.15}) : std::nullopt;
}

struct Point2 {
  double x = 0;
  double y = 0;
};

double estimate(Trial& trial) {
  std::vector<Point2> points;
  const double scale = trial.estimator() == kClumped ? 0.9 : 1;
  double mean = 0;
  for (std::int64_t i = 0; i < trial.n(); ++i) {
    if (!trial.start(i)) {
      return 0;
    }
    const Vec4 u = trial.get_4d(0);
    points.push_back({double{u.x} * scale, double{u.y} * scale});
    mean += (1 - points.back().x) * (1 - points.back().y) / static_cast<double>(trial.n());
  }
  const double error = std::fabs(mean - 0.25);
  if (trial.estimator() == kError) {
    return error;
  }
  // T^2 = 3^-d - 2^(1-d)/n sum prod (1 - x^2) + 1/n^2 sum prod (1 - max(x, x')), Warnock 1972.
  double single = 0;
  double pairs = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!trial.start(static_cast<std::int64_t>(i))) {
      return 0;
    }
    const Point2 p = points[i];
    single += (1 - p.x * p.x) * (1 - p.y * p.y);
    pairs += (1 - p.x) * (1 - p.y);
    for (std::size_t j = 0; j < i; ++j) {
      pairs += 2 * (1 - std::max(p.x, points[j].x)) * (1 - std::max(p.y, points[j].y));
    }
  }
  const auto n = static_cast<double>(trial.n());
  const double t = std::sqrt(std::max(0.0, 1.0 / 9 - single / (2 * n) + pairs / (n * n)));
  return trial.estimator() == kExcess ? std::max(0.0, error - t) : t;
}

Vec4 shown(const Trial& trial) {
  const float scale = trial.estimator() == kClumped ? 0.9F : 1.0F;
  const Vec4 u = trial.get_4d(0);
  return {u.x * scale, u.y * scale, 0, 0};
}

}  // namespace

const Experiment kDiscrepancyExperiment = {
    .name = "discrepancy",
    .title = "Discrepancy, and why quasi-Monte Carlo wins",
    .summary = "The error of an integral is at most the unevenness of the points times that of f.",
    .estimates =
        "The L2 star discrepancy T of n points in the square, or the error of ∫∫ (1 − x)(1 − y) = "
        "¼. Both tend to 0.",
    .formula =
        "T² = ∫∫ (share of points in [0,a) × [0,b) − a b)² da db;  |mean f − ∫f| ≤ T ‖∂²f/∂x∂y‖ "
        "(Koksma, Hlawka, Zaremba);  independent points: E T² = (1/4 − 1/9)/n",
    .look_for =
        "T falls as n^(−1/2) for independent points, n^(−3/4) for stratified ones, nearly n^(−1) "
        "for Sobol points; the bound needs no probability. The error of scrambled points falls "
        "faster still. `excess` is 0: no point set breaks the bound. `clumped` points are even, "
        "but not over the whole square, and T tells.",
    .estimators = kEstimators,
    .estimator = "discrepancy",
    .n = kN,
    .unit = "points",
    .pattern_dimensions = 2,
    .expected = &expected,
    .slope = &slope,
    .evaluations = &evaluations,
    .estimate = &estimate,
    .shown = &shown,
};

}  // namespace core::lab
