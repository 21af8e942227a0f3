// Estimates pi, a classic first Monte Carlo example, in two ways.

#include <cmath>
#include <numbers>

#include "core/lab/experiment_list.h"
#include "core/lab/trial.h"

namespace core::lab {
namespace {

enum { kHit, kHeight };

constexpr std::array kEstimators = {
    EstimatorInfo{"hit", "none",
                  "4 if a point of the unit square lies in the quarter disk, else 0."},
    EstimatorInfo{
        "height", "none",
        "4 sqrt(1 - x^2), the height of the arc: one dimension is integrated analytically."},
};

double expected(const Setup& /*setup*/) { return std::numbers::pi; }

std::optional<TheorySlope> slope(const Setup& setup) {
  const std::string_view s = setup.sampler_name;
  if (s == "independent") {
    return TheorySlope{-0.5};
  }
  const bool hit = setup.estimator == kHit;
  if (s == "antithetic" || s == "zsobol") {  // independent pairs; independent sets of eight
    return TheorySlope{-0.5};
  }
  if (s == "sobol") {
    return hit ? TheorySlope{-0.75} : TheorySlope{-1.5};
  }
  if (s == "stratified") {
    // The height has sqrt(N) strata on its axis with sqrt(N) samples in each.
    return hit ? TheorySlope{-0.75} : TheorySlope{-1.0};
  }
  if (s == "latin-hypercube") {
    return hit ? std::nullopt : std::optional(TheorySlope{-1.5});
  }
  return std::nullopt;
}

double estimate(Trial& trial) {
  const bool hit = trial.estimator() == kHit;
  return mean_of(trial, [&] {
    const Vec4 u = trial.get_4d(0);
    const double x = u.x;
    const double y = u.y;
    return hit ? (x * x + y * y < 1 ? 4.0 : 0.0) : 4 * std::sqrt(1 - x * x);
  });
}

}  // namespace

const Experiment kPiExperiment = {
    .name = "pi",
    .title = "Estimating π",
    .summary =
        "Sample points in a square and count those in the quarter disk, or average the height of "
        "the arc.",
    .estimates = "π, four times the area of a quarter of the unit disk.",
    .formula = "hit: 4/n Σ [xᵢ² + yᵢ² < 1], σ = 1.642;  height: 4/n Σ √(1 − xᵢ²), σ = 0.893",
    .look_for =
        "Both errors fall as n^(−1/2): one more digit costs a hundred times the work. Integrating "
        "one dimension analytically (height) is worth three times the samples. Then change the "
        "sampler: with stratified points the error of `hit` falls as n^(−3/4) because of the edge; "
        "with Owen-scrambled points the error of `height`, which is smooth, falls as n^(−3/2).",
    .estimators = kEstimators,
    .estimator = "hit",
    .unit = "points",
    .pattern_dimensions = 2,
    .expected = &expected,
    .slope = &slope,
    .estimate = &estimate,
};

}  // namespace core::lab
