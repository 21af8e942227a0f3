// The density of photons on a plane, from those within a radius.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/lab/experiment_list.h"
#include "core/lab/trial.h"

namespace core::lab {
namespace {

enum { kFixed, kByN, kProgressive, kNearest, kEdge };
enum { kRadius };

constexpr double kAlpha = 2.0 / 3;
constexpr std::array kEstimators = {
    EstimatorInfo{"fixed", "biased", "One radius for every n: the bias 3/4 r^2 remains."},
    EstimatorInfo{"by-n", "consistent", "r n^(-1/6): bias and noise fall at the same rate."},
    EstimatorInfo{"progressive", "consistent",
                  "Each photon with a smaller radius, r^2 times (i + 2/3) / (i + 1) (Knaus and "
                  "Zwicker 2011)."},
    EstimatorInfo{"nearest", "consistent",
                  "The radius that holds the nearest sqrt(n) photons (Jensen 2001)."},
    EstimatorInfo{"edge", "biased",
                  "As `by-n`, at the edge of a shadow: half of each disk is dark."},
};
constexpr std::array kParameters = {
    ParameterInfo{"radius", 0.02, 0.5, 0.25, false, "Radius, or that of the first photon."},
};

/// Photons have density 3 x^2 on the unit square, estimated at its centre: the mean over a disk is
/// 3/4 + 3/4 r^2. `edge`: density 2 where x > 1/2, else 0; the lit side of the edge has 2.
double expected(const Setup& setup) { return setup.estimator == kEdge ? 2 : 0.75; }

std::optional<TheorySlope> slope(const Setup& setup) {
  switch (setup.estimator) {
    case kByN:
    case kProgressive:
      return TheorySlope{-1.0 / 3};
    case kNearest:
      return TheorySlope{-0.25};
    default:
      return std::nullopt;
  }
}

double estimate(Trial& trial) {
  const std::size_t kind = trial.estimator();
  const auto n = static_cast<double>(trial.n());
  double square = trial.parameter(kRadius) * trial.parameter(kRadius);
  if (kind == kByN || kind == kEdge) {
    square *= std::pow(n, -1.0 / 3);
  }
  std::vector<double> squares;  // of distances
  double sum = 0;
  for (std::int64_t i = 0; i < trial.n(); ++i) {
    if (!trial.start(i)) {
      return 0;
    }
    const Vec4 u = trial.get_4d(0);
    const double x = kind == kEdge ? 0.5 * double{u.x} : std::cbrt(double{u.x}) - 0.5;
    const double y = double{u.y} - 0.5;
    const double d2 = x * x + y * y;
    if (kind == kNearest) {
      squares.push_back(d2);
      continue;
    }
    sum += d2 < square ? 1 / (std::numbers::pi * square) : 0;
    if (kind == kProgressive) {
      const auto pass = static_cast<double>(i + 1);
      square *= (pass + kAlpha) / (pass + 1);
    }
  }
  if (kind != kNearest) {
    return sum / n;
  }
  const auto k = static_cast<std::ptrdiff_t>(std::ceil(std::sqrt(n)));
  std::nth_element(squares.begin(), squares.begin() + (k - 1), squares.end());
  return static_cast<double>(k - 1) /
         (n * std::numbers::pi * squares[static_cast<std::size_t>(k - 1)]);
}

}  // namespace

const Experiment kDensityEstimationExperiment = {
    .name = "density-estimation",
    .title = "Density estimation: the radius",
    .summary = "A large radius blurs, a small one is noisy; no fixed one is right.",
    .estimates =
        "The density 3x² of photons on the unit square at its centre, ¾; for `edge` that on the "
        "lit side of a shadow's edge, 2.",
    .formula =
        "L ≈ Σ f Φᵢ / (π r²);  bias = ¾ r², V = p / (n π r²) − p²/n;  least error for r ~ "
        "n^(−1/6): RMSE ~ n^(−1/3)",
    .look_for =
        "With a `fixed` radius the error stops at ¾ r². Try 0.05 and 0.5: the smaller the radius, "
        "the later it stops and the noisier it starts. Radii that shrink with n keep falling, as "
        "n^(−1/3). At the `edge` of a shadow half of the disk is dark, whatever its radius: the "
        "mean is 1.",
    .estimators = kEstimators,
    .parameters = kParameters,
    .estimator = "by-n",
    .any_sampler = false,
    .unit = "photons",
    .n_least = 4,
    .expected = &expected,
    .slope = &slope,
    .estimate = &estimate,
};

}  // namespace core::lab
