#include "core/film/replicate_fit.h"

#include <algorithm>

#include "core/sampling/optimal_mis.h"

namespace core {
namespace {

/// Coefficients from few samples are pulled to 0, as by this many samples that say nothing.
constexpr double kPull = 2;

double exact(float v) { return static_cast<double>(v); }

/// With one sample of each technique, sum a + (f - a p - b q) / m over both is f / m summed, plus
/// (b - a) (sum of p / m - 1): for each sample q / m is 1 - p / m. So a and b count by their
/// difference alone.
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

/// Least squares: -Cov(x, y) / Var(x), in [0,1] as visibility is: few samples of many emitters may
/// say anything.
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
