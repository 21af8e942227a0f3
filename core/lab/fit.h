/// The straight line through log RMSE over log n, with an interval for its slope.
#pragma once

#include <span>

namespace core::lab {

struct ErrorAt {
  double n = 0;
  double rmse = 0;  ///< > 0
  /// Variance of log rmse, >= 0.
  double log_variance = 0;
};

struct SlopeFit {
  double slope = 0;
  double intercept = 0;       ///< log rmse = intercept + slope log n
  double standard_error = 0;  ///< of the slope, from the points' own variances
};

/// Least squares. Pre: at least two different n; points independent of each other.
SlopeFit fit_slope(std::span<const ErrorAt> points);

/// Variance of log sqrt(mean of squares), from the squares themselves: Var(q) / (4 R mean(q)^2) by
/// the delta method, and at least what normal errors would give, 1 / (2 R).
double log_rmse_variance(std::span<const double> squared_errors);

}  // namespace core::lab
