/// Quantiles of the distributions that intervals are made from.
#pragma once

namespace core {

/// x with P(Z <= x) = p, 0 < p < 1; by bisection.
double normal_quantile(double p);
/// x with P(chi^2 with k degrees of freedom <= x) = p; k > 0, not necessarily whole.
/// Source: Wilson and Hilferty 1931 for k >= 30; else bisection on the regularised incomplete gamma
/// function.
double chi2_quantile(double p, double k);
/// P(chi^2 with k degrees of freedom <= x).
double chi2_cdf(double x, double k);
/// x with P(F <= x) = p, F being the ratio of two independent chi^2 with k degrees of freedom each;
/// k > 0. Source: Paulson 1942 for k >= 30; else bisection on the regularised incomplete beta
/// function.
double f_quantile(double p, double k);
/// x with P(T <= x) = p for Student's t with k degrees of freedom.
double student_t_quantile(double p, double k);

}  // namespace core
