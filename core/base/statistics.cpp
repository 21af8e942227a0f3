#include "core/base/statistics.h"

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

double student_t_cdf(double t, double k) {
  const double tail = 0.5 * incomplete_beta(k / 2, 0.5, k / (k + t * t));
  return t > 0 ? 1 - tail : tail;
}

}  // namespace

double normal_quantile(double p) {
  // Bisection is enough and cannot fail: callers need a few quantiles a second.
  double low = -40;
  double high = 40;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(-middle / std::sqrt(2.0)) < p ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

double chi2_cdf(double x, double k) { return gamma_p(k / 2, x / 2); }

double chi2_quantile(double p, double k) {
  if (k >= 30) {
    const double v = 2 / (9 * k);
    const double base = 1 - v + normal_quantile(p) * std::sqrt(v);
    return k * base * base * base;
  }
  double low = 0;
  double high = k + 60 * std::sqrt(2 * k) + 60;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (chi2_cdf(middle, k) < p ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

double f_quantile(double p, double k) {
  if (k >= 30) {
    // Cube roots of both chi^2 / k are Gaussian with mean 1 - v and variance v.
    const double v = 2 / (9 * k);
    const double z = normal_quantile(p);
    const double m = (1 - v) * (1 - v);
    const double a = m - z * z * v;
    const double root = (m + std::copysign(std::sqrt(m * m - a * a), z)) / a;
    return root * root * root;
  }
  double low = 0;
  double high = 1;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (incomplete_beta(k / 2, k / 2, middle) < p ? low : high) = middle;
  }
  return low / (1 - low);
}

double student_t_quantile(double p, double k) {
  double low = -1e6;
  double high = 1e6;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (student_t_cdf(middle, k) < p ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace core
