/// Fits a straight line to log RMSE over log n, with an interval for its slope.
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
  double standard_error = 0;  ///< of the slope, from the variances of the points
};

/// Fits by least squares. Pre: at least two different n; independent points.
SlopeFit fit_slope(std::span<const ErrorAt> points);

/// Returns the variance of log sqrt(mean of squares), estimated from the squares: Var(q) / (4 R
/// mean(q)^2) by the delta method, and at least that of normal errors, 1 / (2 R).
double log_rmse_variance(std::span<const double> squared_errors);

}  // namespace core::lab
