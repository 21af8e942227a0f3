// Fits a plane to the samples as control variate; and pairs of antithetic samples.

#include <array>
#include <cmath>
#include <numbers>

#include "core/lab/experiment_list.h"
#include "core/lab/trial.h"

namespace core::lab {
namespace {

namespace regression {

enum { kPlain, kSame, kCross };
enum { kIntegrand, kRidge };

constexpr std::array kEstimators = {
    EstimatorInfo{"plain", "none", "The mean of the samples."},
    EstimatorInfo{"same-samples", "consistent", "A plane fitted to the same samples it corrects."},
    EstimatorInfo{"cross-fitted", "none",
                  "A plane fitted to one half of the samples corrects the other half."},
};
constexpr std::array kParameters = {
    ParameterInfo{"integrand", 0, 1, 0, true, "0: the quarter disk x^2 + y^2 < 1; 1: x^8 y^8."},
    ParameterInfo{"ridge", 0, 10, 0, false,
                  "Ridge penalty on the plane's slopes, in units of the variance of x."},
};
constexpr std::array<std::int64_t, 6> kN = {8, 32, 128, 512, 2048, 8192};

double expected(const Setup& setup) {
  return setup.whole(kIntegrand) == 0 ? std::numbers::pi / 4 : 1.0 / 81;
}
std::int64_t rounded(const Setup& /*setup*/, std::int64_t n) { return n + n % 2; }

/// Sums for the least-squares plane f = c + a (x - 1/2) + b (y - 1/2).
struct Sums {
  double n = 0;
  double x = 0;
  double y = 0;
  double f = 0;
  double xx = 0;
  double xy = 0;
  double yy = 0;
  double xf = 0;
  double yf = 0;
  void add(double px, double py, double pf) {
    n += 1;
    x += px;
    y += py;
    f += pf;
    xx += px * px;
    xy += px * py;
    yy += py * py;
    xf += px * pf;
    yf += py * pf;
  }
};

Sums operator+(const Sums& p, const Sums& q) {
  return {p.n + q.n,   p.x + q.x,   p.y + q.y,   p.f + q.f,  p.xx + q.xx,
          p.xy + q.xy, p.yy + q.yy, p.xf + q.xf, p.yf + q.yf};
}

struct Plane {
  double a = 0;
  double b = 0;
};

Plane fit(const Sums& s, double ridge) {
  const double pull = ridge / 12;
  const double xx = s.xx / s.n - s.x / s.n * (s.x / s.n) + pull;
  const double yy = s.yy / s.n - s.y / s.n * (s.y / s.n) + pull;
  const double xy = s.xy / s.n - s.x / s.n * (s.y / s.n);
  const double xf = s.xf / s.n - s.x / s.n * (s.f / s.n);
  const double yf = s.yf / s.n - s.y / s.n * (s.f / s.n);
  const double determinant = xx * yy - xy * xy;
  if (!(determinant > 0)) {
    return {};
  }
  return {(xf * yy - yf * xy) / determinant, (yf * xx - xf * xy) / determinant};
}

/// The plane's integral is c, because x - 1/2 and y - 1/2 have mean zero.
double corrected(const Sums& s, Plane p) { return s.f / s.n - p.a * s.x / s.n - p.b * s.y / s.n; }

double estimate(Trial& trial) {
  const bool disk = trial.whole(kIntegrand) == 0;
  Sums halves[2];
  for (std::int64_t i = 0; i < trial.n(); ++i) {
    if (!trial.start(i)) {
      return 0;
    }
    const Vec4 u = trial.get_4d(0);
    const double x = u.x;
    const double y = u.y;
    const double f = disk ? (x * x + y * y < 1 ? 1.0 : 0.0) : std::pow(x * y, 8);
    halves[2 * i < trial.n() ? 0 : 1].add(x - 0.5, y - 0.5, f);
  }
  const double ridge = trial.parameter(kRidge);
  const Sums all = halves[0] + halves[1];
  switch (trial.estimator()) {
    case kPlain:
      return all.f / all.n;
    case kSame:
      return corrected(all, fit(all, ridge));
    default:
      return 0.5 * (corrected(halves[0], fit(halves[1], ridge)) +
                    corrected(halves[1], fit(halves[0], ridge)));
  }
}

std::optional<TheorySlope> slope(const Setup& setup) {
  return setup.estimator == kPlain ? monte_carlo_slope(setup) : std::nullopt;
}

}  // namespace regression

namespace antithetic {

enum { kPlain, kPairs };
enum { kIntegrand };

constexpr std::array kEstimators = {
    EstimatorInfo{"plain", "none", "The mean over the sampler's numbers, unpaired."},
    EstimatorInfo{"pairs", "none", "(f(u) + f(1 - u)) / 2 over half as many numbers."},
};
constexpr std::array kParameters = {
    ParameterInfo{"integrand", 0, 1, 0, true,
                  "0: e^u, nearly odd about 1/2; 1: (u - 1/2)^2, even."},
};

double expected(const Setup& setup) {
  return setup.whole(kIntegrand) == 0 ? std::numbers::e - 1 : 1.0 / 12;
}
std::int64_t rounded(const Setup& /*setup*/, std::int64_t n) { return n + n % 2; }

double estimate(Trial& trial) {
  const bool exponential = trial.whole(kIntegrand) == 0;
  const auto f = [exponential](double u) {
    return exponential ? std::exp(u) : (u - 0.5) * (u - 0.5);
  };
  if (trial.estimator() == kPlain) {
    return mean_of(trial, [&] { return f(double{trial.get_4d(0).x}); });
  }
  double sum = 0;
  const std::int64_t pairs = trial.n() / 2;  // n is odd under some samplers' rules
  for (std::int64_t i = 0; i < pairs; ++i) {
    if (!trial.start(i)) {
      return 0;
    }
    const double u = trial.get_4d(0).x;
    sum += f(u) + f(1 - u);
  }
  return sum / static_cast<double>(2 * pairs);
}

std::optional<TheorySlope> slope(const Setup& setup) {
  const bool plain_pairs = setup.estimator == kPlain && setup.sampler_name == "antithetic";
  return plain_pairs ? std::optional(TheorySlope{-0.5}) : monte_carlo_slope(setup);
}

}  // namespace antithetic
}  // namespace

const Experiment kRegressionExperiment = {
    .name = "regression",
    .title = "Regression",
    .summary =
        "Fit a simple model to the samples, integrate it exactly, and estimate the remainder by "
        "sampling.",
    .estimates = "The area π/4 of a quarter disk, or ∫ x⁸y⁸ = 1/81, over the unit square.",
    .formula = "I ≈ c + 1/n Σ (f(xᵢ) − c − a(xᵢ − ½) − b(yᵢ − ½)),  (a, b, c) by least squares",
    .look_for =
        "Fitted to the samples it corrects, the plane is biased at n = 8: by a few percent for the "
        "disk, by tens of percent for x⁸y⁸. With cross-fitting the mean is right, but a plane "
        "fitted to only four samples is mostly noise, and the error is larger than without a "
        "plane. From n = 32 on it pays off.",
    .estimators = regression::kEstimators,
    .parameters = regression::kParameters,
    .estimator = "same-samples",
    .n = regression::kN,
    .unit = "samples",
    .n_least = 8,
    .expected = &regression::expected,
    .slope = &regression::slope,
    .rounded = &regression::rounded,
    .estimate = &regression::estimate,
};

const Experiment kAntitheticExperiment = {
    .name = "antithetic",
    .title = "Antithetic pairs",
    .summary = "Use each random number u together with 1 − u: errors of opposite sign cancel.",
    .estimates = "∫ eᵘ du = e − 1, or ∫ (u − ½)² du = 1/12, over the unit interval.",
    .formula =
        "(f(u) + f(1 − u))/2;  Var of a pair = (Var f + Cov(f(u), f(1 − u)))/2:  0.00391 against "
        "0.121 for eᵘ",
    .look_for =
        "For eᵘ the variance at equal work is 31 times smaller. For an even function both members "
        "of a pair have the same value, and the variance doubles. A pair is one sample: computing "
        "s² from the single values would be wrong.",
    .estimators = antithetic::kEstimators,
    .parameters = antithetic::kParameters,
    .estimator = "pairs",
    .unit = "evaluations",
    .n_least = 2,
    .expected = &antithetic::expected,
    .slope = &antithetic::slope,
    .rounded = &antithetic::rounded,
    .estimate = &antithetic::estimate,
};

}  // namespace core::lab
