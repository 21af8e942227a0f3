#include "core/film/replicate_fit.h"

#include <algorithm>

#include "core/sampling/optimal_mis.h"

namespace core {
namespace {

/// Coefficients from few samples are shrunk towards 0, as by this many samples without information.
constexpr double kPull = 2;

double exact(float v) { return static_cast<double>(v); }

/// With one sample of each technique, a + (f - a p - b q) / m summed over both is the sum of f / m
/// plus (b - a) (sum of p / m - 1), because q / m is 1 - p / m for each sample. So only the
/// difference of a and b matters.
Rgb optimal_mis(const ReplicateFit& s) noexcept {
  const double x = exact(s.x);
  const double xx = exact(s.xx);
  const OptimalMisMatrix a = {xx, x - xx, exact(s.n) - 2 * x + xx};
  const auto channel = [&](float y, float xy) {
    const OptimalMisCoefficients c = solve_optimal_mis(a, exact(xy), exact(y) - exact(xy));
    return static_cast<float>((c.q - c.p) * exact(s.n) / (exact(s.n) + kPull));
  };
  return {channel(s.y.r, s.xy.r), channel(s.y.g, s.xy.g), channel(s.y.b, s.xy.b)};
}

/// Least squares: -Cov(x, y) / Var(x), clamped to [0,1] like visibility, because few samples of
/// many emitters may give any value.
Rgb regression(const ReplicateFit& s) noexcept {
  const double n = exact(s.n);
  const double variance = exact(s.xx) - exact(s.x) * exact(s.x) / n;
  const double covariance = exact(s.xy.g) - exact(s.x) * exact(s.y.g) / n;
  if (!(n > 0) || !(variance > 1e-6 * exact(s.xx))) {
    return {};
  }
  const double slope = std::clamp(-covariance / variance, 0.0, 1.0);
  return Rgb(static_cast<float>(slope * n / (n + kPull)));
}

}  // namespace

FitType fit_type(const RenderSettings& settings) noexcept {
  const EstimatorSettings& e = settings.estimator;
  if (e.control_variate == ControlVariateType::kRegression) {
    return FitType::kRegression;
  }
  return e.mis == MisType::kOptimal && e.strategy == Strategy::kMis ? FitType::kOptimalMis
                                                                    : FitType::kNone;
}

Rgb fitted_coefficient(FitType type, const ReplicateFit& sums) noexcept {
  if (type == FitType::kOptimalMis) {
    return optimal_mis(sums);
  }
  return type == FitType::kRegression ? regression(sums) : Rgb();
}

}  // namespace core
