/// Quantiles of the distributions used for intervals.
#pragma once

namespace core {

/// Returns x with P(Z <= x) = p, 0 < p < 1; by bisection.
double normal_quantile(double p);
/// Returns x with P(chi^2 with k degrees of freedom <= x) = p; k > 0, not necessarily an integer.
/// Source: Wilson and Hilferty 1931 for k >= 30; else bisection on the regularised incomplete gamma
/// function.
double chi2_quantile(double p, double k);
/// Returns P(chi^2 with k degrees of freedom <= x).
double chi2_cdf(double x, double k);
/// Returns x with P(F <= x) = p, where F is the ratio of two independent chi^2 variables with k
/// degrees of freedom each; k > 0. Source: Paulson 1942 for k >= 30; else bisection on the
/// regularised incomplete beta function.
double f_quantile(double p, double k);
/// Returns x with P(T <= x) = p for Student's t with k degrees of freedom.
double student_t_quantile(double p, double k);

/// Limits of the probability of an event that happened in k of n independent trials: it is above
/// the upper one, or below the lower one, with probability at most alpha each. n > 0, 0 <= k <= n.
/// Source: Clopper and Pearson 1934.
double binomial_upper(double k, double n, double alpha);
double binomial_lower(double k, double n, double alpha);
/// Returns the probability of k events or more in n independent trials of probability p.
double binomial_tail(double k, double n, double p);

}  // namespace core
