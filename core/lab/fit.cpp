#include "core/lab/fit.h"

#include <algorithm>
#include <cmath>

#include "core/base/check.h"

namespace core::lab {

SlopeFit fit_slope(std::span<const ErrorAt> points) {
  double mean_x = 0;
  double mean_y = 0;
  for (const ErrorAt& p : points) {
    mean_x += std::log(p.n);
    mean_y += std::log(p.rmse);
  }
  const auto count = static_cast<double>(points.size());
  mean_x /= count;
  mean_y /= count;
  double xx = 0;
  double xy = 0;
  double noise = 0;
  for (const ErrorAt& p : points) {
    const double dx = std::log(p.n) - mean_x;
    xx += dx * dx;
    xy += dx * (std::log(p.rmse) - mean_y);
    noise += dx * dx * p.log_variance;
  }
  CHECK(xx > 0);
  return {.slope = xy / xx,
          .intercept = mean_y - xy / xx * mean_x,
          .standard_error = std::sqrt(noise) / xx};
}

double log_rmse_variance(std::span<const double> squared_errors) {
  const auto r = static_cast<double>(squared_errors.size());
  double mean = 0;
  for (const double q : squared_errors) {
    mean += q / r;
  }
  double spread = 0;
  for (const double q : squared_errors) {
    spread += (q - mean) * (q - mean);
  }
  const double normal = 1 / (2 * r);
  return mean > 0 && r > 1 ? std::max(spread / (r - 1) / (4 * r * mean * mean), normal) : normal;
}

}  // namespace core::lab
