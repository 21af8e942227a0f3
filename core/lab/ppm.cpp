// Progressive density estimation: a shrinking radius trades bias for variance.

#include <algorithm>
#include <cmath>

#include "core/lab/experiment_list.h"
#include "core/lab/trial.h"

namespace core::lab {
namespace {

enum { kProgressive, kFixed };
enum { kAlpha, kPhotons, kRadius };

constexpr std::array kEstimators = {
    EstimatorInfo{"progressive", "consistent", "The radius shrinks from pass to pass."},
    EstimatorInfo{"fixed", "biased", "The radius stays the same."},
};
constexpr std::array kParameters = {
    ParameterInfo{"alpha", 0.05, 0.99, 2.0 / 3, false,
                  "Fraction of the photons kept when the radius shrinks."},
    ParameterInfo{"photons", 1, 1024, 16, true, "Photons per pass."},
    ParameterInfo{"radius", 0.01, 0.5, 0.25, false, "Radius of the first pass."},
};
constexpr std::array<std::int64_t, 6> kN = {16, 64, 256, 1024, 4096, 16384};

/// Photons have density 3 x^2 on [0,1], estimated at x = 1/2. The mean over [1/2 - r, 1/2 + r] is
/// 3/4 + r^2.
double expected(const Setup& /*setup*/) { return 0.75; }

double evaluations(const Setup& setup, std::int64_t n) {
  return static_cast<double>(n) * ((setup.whole(kPhotons) + 3) / 4);
}

double estimate(Trial& trial) {
  const int photons = trial.whole(kPhotons);
  const double alpha = trial.parameter(kAlpha);
  double radius = trial.parameter(kRadius);
  double sum = 0;
  trial.add_cost(static_cast<double>(trial.n()) * photons);
  for (std::int64_t pass = 0; pass < trial.n(); ++pass) {
    if (!trial.start(pass)) {
      return 0;
    }
    int near = 0;
    for (int group = 0; 4 * group < photons; ++group) {
      const Vec4 u = trial.get_4d(group);
      const std::array<float, 4> all = {u.x, u.y, u.z, u.w};
      for (int k = 0; k < std::min(4, photons - 4 * group); ++k) {
        near +=
            std::fabs(std::cbrt(double{all[static_cast<std::size_t>(k)]}) - 0.5) < radius ? 1 : 0;
      }
    }
    sum += near / (2 * radius * photons);
    if (trial.estimator() == kProgressive) {
      const auto i = static_cast<double>(pass + 1);
      radius *= (i + alpha) / (i + 1);
    }
  }
  return sum / static_cast<double>(trial.n());
}

/// Pass i has r ~ i^-(1 - alpha), variance ~ 1/r and bias ~ r^2: the mean of n has error
/// n^(-alpha/2) and bias n^(-2 (1 - alpha)) (or n^-1 log n if that is faster).
std::optional<TheorySlope> slope(const Setup& setup) {
  if (setup.estimator == kFixed) {
    return std::nullopt;
  }
  const double alpha = setup.parameter(kAlpha);
  return TheorySlope{std::max(-alpha / 2, -std::min(1.0, 2 * (1 - alpha))), 0.1};
}

}  // namespace

const Experiment kPpmExperiment = {
    .name = "ppm-1d",
    .title = "Progressive density estimation",
    .summary =
        "Count photons near a point: with a large radius the estimate is biased, with a small one "
        "noisy, with a shrinking one consistent.",
    .estimates = "The density 3x² of photons on a line, at x = ½, which is ¾.",
    .formula =
        "1/n Σ countᵢ / (2 rᵢ m),  rᵢ₊₁ = rᵢ (i + α)/(i + 1);  bias = mean of rᵢ²,  RMSE ~ "
        "n^(−α/2) for α ≤ 4/5",
    .look_for =
        "With a fixed radius the error falls until only the bias r² remains, and the curve levels "
        "off. With α = 2/3 it keeps falling, as n^(−1/3), slower than the n^(−1/2) of unbiased "
        "methods. A larger α gives less noise, but the bias decreases more slowly.",
    .estimators = kEstimators,
    .parameters = kParameters,
    .estimator = "progressive",
    .any_sampler = false,
    .n = kN,
    .unit = "passes",
    .expected = &expected,
    .slope = &slope,
    .evaluations = &evaluations,
    .estimate = &estimate,
};

}  // namespace core::lab
