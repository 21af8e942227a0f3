#include "core/base/statistics.h"

#include <algorithm>
#include <cmath>

namespace core {
namespace {

/// Regularised lower incomplete gamma function P(a, x).
/// Source: Numerical Recipes 3rd ed., 6.2: series below a + 1, continued fraction above.
double gamma_p(double a, double x) {
  if (x <= 0) {
    return 0;
  }
  const double scale = std::exp(-x + a * std::log(x) - std::lgamma(a));
  if (x < a + 1) {
    double term = 1 / a;
    double sum = term;
    for (int n = 1; n < 10000 && term > sum * 1e-16; ++n) {
      term *= x / (a + n);
      sum += term;
    }
    return sum * scale;
  }
  constexpr double kTiny = 1e-300;
  double b = x + 1 - a;
  double c = 1 / kTiny;
  double d = 1 / b;
  double h = d;
  for (int i = 1; i < 10000; ++i) {
    const double an = -i * (i - a);
    b += 2;
    d = an * d + b;
    d = 1 / (std::fabs(d) < kTiny ? kTiny : d);
    c = b + an / c;
    c = std::fabs(c) < kTiny ? kTiny : c;
    const double step = d * c;
    h *= step;
    if (std::fabs(step - 1) < 1e-15) {
      break;
    }
  }
  return 1 - scale * h;
}

/// Regularised incomplete beta function, Lentz's continued fraction.
double beta_fraction(double a, double b, double x) {
  constexpr double kTiny = 1e-300;
  double c = 1;
  double d = 1 - (a + b) * x / (a + 1);
  d = 1 / (std::fabs(d) < kTiny ? kTiny : d);
  double h = d;
  for (int m = 1; m < 10000; ++m) {
    const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
    d = 1 + even * d;
    d = 1 / (std::fabs(d) < kTiny ? kTiny : d);
    c = 1 + even / c;
    c = std::fabs(c) < kTiny ? kTiny : c;
    h *= d * c;
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
    d = 1 + odd * d;
    d = 1 / (std::fabs(d) < kTiny ? kTiny : d);
    c = 1 + odd / c;
    c = std::fabs(c) < kTiny ? kTiny : c;
    const double step = d * c;
    h *= step;
    if (std::fabs(step - 1) < 1e-15) {
      break;
    }
  }
  return h;
}

double incomplete_beta(double a, double b, double x) {
  if (x <= 0) {
    return 0;
  }
  if (x >= 1) {
    return 1;
  }
  const double front = std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) +
                                a * std::log(x) + b * std::log1p(-x));
  return x < (a + 1) / (a + b + 2) ? front * beta_fraction(a, b, x) / a
                                   : 1 - front * beta_fraction(b, a, 1 - x) / b;
}

/// Returns where the increasing function f equals `value`, between low and high. Source: Numerical
/// Recipes 3rd ed., 9.2.1 (Ridders); each round at least halves the bracket.
template <typename Function>
double solve(const Function& f, double value, double low, double high) {
  double f_low = f(low) - value;
  double f_high = f(high) - value;
  double x = low;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    const double f_middle = f(middle) - value;
    const double before = x;
    x = middle - (middle - low) * f_middle / std::sqrt(f_middle * f_middle - f_low * f_high);
    // NaN: f equals `value` at the middle and at an end.
    if (f_middle == 0 || std::isnan(x)) {
      return middle;
    }
    const double f_x = f(x) - value;
    // Far from the middle x has few correct digits yet.
    const bool is_same = std::fabs(x - before) <= 4e-16 * std::fabs(x);
    if (f_x == 0 || (is_same && std::fabs(middle) <= 4 * std::fabs(x))) {
      return x;
    }
    const bool is_x_above = f_x > 0;
    if (is_x_above == (f_middle > 0)) {  // Both are on one side: x is closer.
      (is_x_above ? high : low) = x;
      (is_x_above ? f_high : f_low) = f_x;
    } else {
      low = is_x_above ? middle : x;
      f_low = is_x_above ? f_middle : f_x;
      high = is_x_above ? x : middle;
      f_high = is_x_above ? f_x : f_middle;
    }
  }
  return x;
}

}  // namespace

double normal_quantile(double p) {
  return solve([](double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); }, p, -40, 40);
}

double chi2_cdf(double x, double k) { return gamma_p(k / 2, x / 2); }

double chi2_quantile(double p, double k) {
  if (k >= 30) {
    const double v = 2 / (9 * k);
    const double base = 1 - v + normal_quantile(p) * std::sqrt(v);
    return k * base * base * base;
  }
  return solve([k](double x) { return chi2_cdf(x, k); }, p, 0, k + 60 * std::sqrt(2 * k) + 60);
}

double f_quantile(double p, double k) {
  if (k >= 30) {
    // The cube roots of both chi^2 / k are approximately Gaussian with mean 1 - v and variance v.
    const double v = 2 / (9 * k);
    const double z = normal_quantile(p);
    const double m = (1 - v) * (1 - v);
    const double a = m - z * z * v;
    const double root = (m + std::copysign(std::sqrt(m * m - a * a), z)) / a;
    return root * root * root;
  }
  const double x = solve([k](double at) { return incomplete_beta(k / 2, k / 2, at); }, p, 0, 1);
  return x / (1 - x);
}

double student_t_quantile(double p, double k) {
  const double above = std::min(p, 1 - p);
  // Minus the upper tail: as accurate in the tails as near zero.
  const auto cdf_below_one = [k](double t) {
    return -0.5 * incomplete_beta(k / 2, 0.5, k / (k + t * t));
  };
  double high = 1;
  while (cdf_below_one(high) < -above) {
    high *= 2;
  }
  return std::copysign(solve(cdf_below_one, -above, 0, high), p - 0.5);
}

double binomial_tail(double k, double n, double p) {
  return k <= 0 ? 1.0 : incomplete_beta(k, n - k + 1, p);
}

double binomial_upper(double k, double n, double alpha) {
  if (k >= n) {
    return 1;
  }
  if (k <= 0) {
    return -std::expm1(std::log(alpha) / n);
  }
  // Bisects in the logarithm: rates may be tiny.
  const auto below = [=](double log_p) { return binomial_tail(k + 1, n, std::exp(log_p)); };
  return std::exp(solve(below, 1 - alpha, std::log(k / n), 0));
}

double binomial_lower(double k, double n, double alpha) {
  if (k <= 0) {
    return 0;
  }
  const auto above = [=](double log_p) { return binomial_tail(k, n, std::exp(log_p)); };
  return std::exp(solve(above, alpha, std::log(k / n) - 40, std::log(k / n)));
}

}  // namespace core
