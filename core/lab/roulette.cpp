// Work skipped at random and work repeated: Russian roulette and splitting.

#include <algorithm>
#include <cmath>

#include "core/lab/experiment_list.h"
#include "core/lab/trial.h"

namespace core::lab {
namespace {

namespace roulette {

enum { kNone, kThroughput, kThreshold, kForgotten };
enum { kProbability, kDelta, kShadowCost };

constexpr std::array kEstimators = {
    EstimatorInfo{"none", "none", "No roulette: a shadow ray for every contribution."},
    EstimatorInfo{"throughput", "none", "Continues with fixed `probability` q and divides by q."},
    EstimatorInfo{
        "threshold", "none",
        "Continues with q = min(1, t / delta): small contributions rarely cost a shadow ray."},
    EstimatorInfo{"forgotten", "biased",
                  "Deliberately wrong: as `throughput`, but without dividing by q."},
};
constexpr std::array kParameters = {
    ParameterInfo{"probability", 0.01, 1, 0.5, false, "Probability q of `throughput`."},
    ParameterInfo{"delta", 0.001, 4, 0.5, false,
                  "Contribution above which a shadow ray is always traced."},
    ParameterInfo{"shadow_cost", 0, 1000, 10, false,
                  "Cost of a shadow ray; computing the contribution costs 1."},
};

double expected(const Setup& /*setup*/) { return 0.5; }

double estimate(Trial& trial) {
  const double delta = trial.parameter(kDelta);
  return mean_of(trial, [&]() -> double {
    const Vec4 u = trial.get_4d(0);
    const double x = u.x;
    const double t = 4 * x * x * x;  // unoccluded contribution: mean 1, mostly small
    double q = 1;
    if (trial.estimator() == kThreshold) {
      q = std::min(1.0, t / delta);
    } else if (trial.estimator() != kNone) {
      q = trial.parameter(kProbability);
    }
    trial.add_cost(1);
    if (!(double{u.w} < q)) {
      return 0;
    }
    trial.add_cost(trial.parameter(kShadowCost));
    const double seen = u.y < 0.5F ? t : 0;
    return trial.estimator() == kForgotten ? seen : seen / q;
  });
}

}  // namespace roulette

namespace splitting {

enum { kNone, kFixed, kOptimal };
enum { kCopies, kCostRatio };

constexpr int kCopiesMax = 64;
constexpr std::array kEstimators = {
    EstimatorInfo{"none", "none", "One y per x."},
    EstimatorInfo{"fixed", "none", "`copies` values of y per x, each with weight 1 / copies."},
    EstimatorInfo{"optimal", "none",
                  "The number of copies that is optimal for the variances and costs."},
};
constexpr std::array kParameters = {
    ParameterInfo{"copies", 1, kCopiesMax, 8, true, "Values of y per x, for `fixed`."},
    ParameterInfo{"cost_ratio", 0.01, 1000, 10, false, "Cost of an x relative to that of a y."},
};

double expected(const Setup& /*setup*/) { return 1; }

int copies(const Setup& setup) {
  switch (setup.estimator) {
    case kNone:
      return 1;
    case kFixed:
      return setup.whole(kCopies);
    default:
      // E Var(F|x) = E[4 x^2] / 3 = 4/9 and Var E(F|x) = Var(2 x) = 1/3.
      return std::clamp(
          static_cast<int>(std::lround(std::sqrt(4.0 / 3.0 * setup.parameter(kCostRatio)))), 1,
          kCopiesMax);
  }
}

double evaluations(const Setup& setup, std::int64_t n) {
  return static_cast<double>(n) * (1 + copies(setup));
}

double estimate(Trial& trial) {
  const int s = copies(trial.setup());
  trial.add_cost(static_cast<double>(trial.n()) * (trial.parameter(kCostRatio) + s));
  return mean_of(trial, [&] {
    const double x = trial.get_4d(0).x;
    double sum = 0;
    for (int k = 0; k < s; ++k) {
      sum += 4 * x * double{trial.get_4d(1 + k).x};
    }
    return sum / s;
  });
}

}  // namespace splitting
}  // namespace

const Experiment kRouletteExperiment = {
    .name = "rr-threshold",
    .title = "Russian roulette",
    .summary =
        "Do work with some probability and divide by it: the mean stays the same, and the variance "
        "rises in exchange for less work.",
    .estimates =
        "The mean of t V, an unoccluded contribution t = 4u³ times a visibility V that is 1 half "
        "of the time; 1/2.",
    .formula =
        "X/q with probability q, else 0;  Var′ = E[X²/q] − μ²;  efficiency = 1 / (Var · cost)",
    .look_for =
        "Roulette always raises the error at equal n; compare `efficiency_by_cost`. With a "
        "constant q it rarely pays off. With q = min(1, t/δ) only small contributions are subject "
        "to roulette: nearly the same error with fewer shadow rays. `forgotten` shows what happens "
        "without 1/q.",
    .estimators = roulette::kEstimators,
    .parameters = roulette::kParameters,
    .estimator = "threshold",
    .unit = "contributions",
    .expected = &roulette::expected,
    .estimate = &roulette::estimate,
};

const Experiment kSplittingExperiment = {
    .name = "splitting",
    .title = "Splitting",
    .summary = "When a path prefix is expensive, reuse it.",
    .estimates = "E[4 x y] = 1 for uniform x and y, where an x costs more than a y.",
    .formula =
        "1/n Σ 1/s Σ F(xᵢ, yᵢₖ);  Var = (Var E[F|x] + E Var[F|x] / s) / n;  "
        "s* = √(E Var[F|x] / Var E[F|x] · c_x/c_y) = √(4/3 · cost_ratio)",
    .look_for =
        "More copies always lower the error at equal n, but never below that of E[F|x]. Compare "
        "`efficiency_by_cost`: it peaks at s* and falls on both sides.",
    .estimators = splitting::kEstimators,
    .parameters = splitting::kParameters,
    .estimator = "optimal",
    .unit = "values of x",
    .expected = &splitting::expected,
    .evaluations = &splitting::evaluations,
    .estimate = &splitting::estimate,
};

}  // namespace core::lab
