// Variance and bias of estimators of a variance; means of values without a variance.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/base/statistics.h"
#include "core/error/error_estimate.h"
#include "core/film/half_sums.h"
#include "core/lab/experiment_list.h"
#include "core/lab/trial.h"

namespace core::lab {
namespace {

namespace mse {

enum { kUnbiased, kByN, kLeast, kFirst, kForgotten };

constexpr std::int64_t kFirstFew = 16;
constexpr std::array kEstimators = {
    EstimatorInfo{"unbiased", "none", "s^2 = S / (n - 1), where S = sum of (x - mean x)^2."},
    EstimatorInfo{"by-n", "consistent", "S / n: a little too small, with less variance."},
    EstimatorInfo{"least-mse", "consistent",
                  "S / (n + 1): the least mean squared error of the three."},
    EstimatorInfo{"first-16", "none",
                  "s^2 of the first 16 samples only: unbiased, but not consistent."},
    EstimatorInfo{"forgotten", "biased",
                  "Deliberately wrong: the mean of x^2, without subtracting the mean."},
};

/// Samples are normal with mean 1 and variance 1.
double expected(const Setup& /*setup*/) { return 1; }

std::optional<TheorySlope> slope(const Setup& setup) {
  return setup.estimator == kForgotten
             ? std::nullopt
             : std::optional(TheorySlope{setup.estimator == kFirst ? 0 : -0.5});
}

double estimate(Trial& trial) {
  const std::int64_t used = trial.estimator() == kFirst ? kFirstFew : trial.n();
  double mean = 0;
  double sum = 0;  // S, by Welford's recurrence
  double squares = 0;
  for (std::int64_t i = 0; i < used; ++i) {
    if (!trial.start(i)) {
      return 0;
    }
    const Vec4 u = trial.get_4d(0);
    const double x = 1 + std::sqrt(-2 * std::log(1 - double{u.x})) *
                             std::cos(2 * std::numbers::pi * double{u.y});
    const double before = x - mean;
    mean += before / static_cast<double>(i + 1);
    sum += before * (x - mean);
    squares += x * x;
  }
  const auto n = static_cast<double>(used);
  switch (trial.estimator()) {
    case kByN:
      return sum / n;
    case kLeast:
      return sum / (n + 1);
    case kForgotten:
      return squares / n;
    default:
      return sum / (n - 1);
  }
}

}  // namespace mse

namespace heavy {

enum { kClassical, kMatched, kProduct, kMedian, kTail };
enum { kExponent };

constexpr int kIntervals = 16;
constexpr int kImageSide = 8;
constexpr int kGroups = 9;
constexpr double kConfidence = 0.95;

constexpr std::array kEstimators = {
    EstimatorInfo{"classical", "biased",
                  "Share of the intervals mean +- t s / sqrt(n) that contain the exact value; they "
                  "assume a variance that does not exist."},
    EstimatorInfo{"matched", "consistent",
                  "The same intervals, with a density proportional to u^-a: finite variance."},
    EstimatorInfo{"grain-and-doubt", "biased",
                  "Share of the renderer's intervals, from the halves of an image of 8 x 8 such "
                  "pixels, that contain the image's error: more than stated, on the safe side."},
    EstimatorInfo{"median-of-means", "consistent",
                  "The median of nine means, divided by the exact value: shows the slope."},
    EstimatorInfo{"tail-index", "none",
                  "The mean of ln x, which estimates a = 1 / (tail index) (Hill 1975)."},
};
constexpr std::array kParameters = {
    ParameterInfo{"exponent", 0.1, 0.9, 0.6, false,
                  "a in x = (1 - a) u^-a. The variance is infinite from a = 1/2 on."},
};
constexpr std::array<std::int64_t, 4> kN = {32, 128, 512, 2048};

double expected(const Setup& setup) {
  return setup.estimator == kTail     ? setup.parameter(kExponent)
         : setup.estimator == kMedian ? 1
                                      : kConfidence;
}

double evaluations(const Setup& setup, std::int64_t n) {
  const double each = setup.estimator == kProduct   ? kImageSide * kImageSide
                      : setup.estimator <= kMatched ? kIntervals
                                                    : 1;
  return each * static_cast<double>(n);
}

/// Sums of stable laws fall as n^-(1 - a) (Gnedenko and Kolmogorov 1954).
std::optional<TheorySlope> slope(const Setup& setup) {
  if (setup.estimator == kTail) {
    return TheorySlope{-0.5};
  }
  if (setup.estimator == kMedian) {
    return TheorySlope{-std::min(0.5, 1 - setup.parameter(kExponent)), 0.1};
  }
  return std::nullopt;
}

/// An estimate of 1: x = (1 - a) u^-a times a uniform number of mean 1.
double heavy_value(const Trial& trial) {
  const double a = trial.parameter(kExponent);
  const Vec4 u = trial.get_4d(0);
  const double rest = 2 * double{u.y};
  // With the density (1 - a) u^-a only `rest` remains.
  return trial.estimator() == kMatched ? rest : (1 - a) * std::pow(1 - double{u.x}, -a) * rest;
}

double covered_by_classical(Trial& trial) {
  const auto n = static_cast<double>(trial.n());
  const double t = student_t_quantile((1 + kConfidence) / 2, n - 1);
  double covered = 0;
  for (int k = 0; k < kIntervals; ++k) {
    double sum = 0;
    double squares = 0;
    for (std::int64_t i = 0; i < trial.n(); ++i) {
      if (!trial.start_at(k, i)) {
        return 0;
      }
      const double x = heavy_value(trial);
      sum += x;
      squares += x * x;
    }
    const double mean = sum / n;
    const double s2 = (squares - n * mean * mean) / (n - 1);
    covered += std::fabs(mean - 1) <= t * std::sqrt(s2 / n) ? 1 : 0;
  }
  return covered / kIntervals;
}

/// Every pixel has the value 1 and half of the samples in each half of the image.
double covered_by_product(Trial& trial) {
  std::vector<ReplicatePixel> pixels;
  double roots = 0;
  for (int p = 0; p < kImageSide * kImageSide; ++p) {
    double halves[2] = {0, 0};
    for (std::int64_t i = 0; i < trial.n(); ++i) {
      if (!trial.start_at(p, i)) {
        return 0;
      }
      halves[i % 2] += heavy_value(trial) * 2 / static_cast<double>(trial.n());
    }
    for (const double half : halves) {
      const auto v = static_cast<float>(half);
      pixels.push_back({.mean_r = v, .mean_g = v, .mean_b = v, .mean_alpha = 1, .count = 1});
    }
    roots += std::sqrt((halves[0] + halves[1]) / 2);
  }
  const PixelRect rect = {0, 0, kImageSide, kImageSide};
  const double count = kImageSide * kImageSide;
  const TileSums sums = half_sums(rect, pixels, 2, error_floor(roots / count));
  double error = 0;  // F of the exact image is 0.05
  for (std::size_t p = 0; p < pixels.size(); p += 2) {
    const double value = 0.5 * (double{pixels[p].mean_r} + double{pixels[p + 1].mean_r});
    error += 3 * std::fabs(value - 1) / (3 * std::max(value, 1.0) + error_floor(1)) / count;
  }
  const double reach = normal_quantile((1 + kConfidence) / 2) * std::sqrt(2 * sums.squares) / count;
  const ErrorInterval interval = error_interval(sums.grain / count, sums.doubt / count, reach);
  return interval.low <= error && error <= interval.high ? 1 : 0;
}

double estimate(Trial& trial) {
  switch (trial.estimator()) {
    case kClassical:
    case kMatched:
      trial.add_cost(evaluations(trial.setup(), trial.n()));
      return covered_by_classical(trial);
    case kProduct:
      trial.add_cost(evaluations(trial.setup(), trial.n()));
      return covered_by_product(trial);
    case kTail:
      return mean_of(trial, [&] {
        return -trial.parameter(kExponent) * std::log(1 - double{trial.get_4d(0).x});
      });
    default:
      break;
  }
  std::array<double, kGroups> means{};
  for (std::int64_t i = 0; i < trial.n(); ++i) {
    if (!trial.start(i)) {
      return 0;
    }
    means[static_cast<std::size_t>(i % kGroups)] += heavy_value(trial);
  }
  std::nth_element(means.begin(), means.begin() + kGroups / 2, means.end());
  return means[kGroups / 2] * kGroups / static_cast<double>(trial.n());
}

std::int64_t rounded(const Setup& setup, std::int64_t n) {
  return setup.estimator == kMedian ? (n + kGroups - 1) / kGroups * kGroups : n + n % 2;
}

}  // namespace heavy
}  // namespace

const Experiment kMseExperiment = {
    .name = "mse",
    .title = "Mean squared error: variance plus squared bias",
    .summary =
        "Five estimators of one variance: unbiased or not, consistent or not, and the smallest "
        "error is a biased one's.",
    .estimates = "The variance of normal samples of mean 1: 1.",
    .formula =
        "MSE = E(X − μ)² = V[X] + (E[X] − μ)²;  S/(n − 1): V = 2/(n − 1), b = 0;  S/n: V = "
        "2(n − 1)/n², b = −1/n;  S/(n + 1): MSE = 2/(n + 1)",
    .look_for =
        "At n = 16 the two biased estimators have the smaller error; their bias 1/n vanishes "
        "faster than the noise n^(−1/2), so they are consistent. `first-16` is unbiased for every "
        "n, yet its error never falls. `forgotten` converges, to 2. The verdict splits each "
        "squared error into its two parts.",
    .estimators = mse::kEstimators,
    .estimator = "by-n",
    .any_sampler = false,
    .unit = "samples",
    .n_least = mse::kFirstFew,
    .expected = &mse::expected,
    .slope = &mse::slope,
    .estimate = &mse::estimate,
};

const Experiment kInfiniteVarianceExperiment = {
    .name = "infinite-variance",
    .title = "An estimator without a variance",
    .summary =
        "If f²/p has no integral, the mean still converges, but slowly, and its interval is wrong "
        "for every n.",
    .estimates =
        "The share of 95% intervals that contain the exact value (0.95 if they are right); for "
        "`median-of-means` the mean itself, for `tail-index` the exponent a.",
    .formula =
        "x = (1 − a) u^(−a), E[x] = 1, P(x > t) ~ t^(−1/a);  V[x] = ∞ for a ≥ ½;  error of the "
        "mean ~ n^(−(1 − a))",
    .look_for =
        "`classical` intervals miss the value far more often than 5%, and more samples do not "
        "help: most sets of samples lack the rare large values, so both their mean and their s are "
        "too small. With a density that follows the peak (`matched`) they are right. The "
        "renderer's `grain-and-doubt` limits what one pixel can contribute, so its interval needs "
        "no variance and errs on the safe side. Try a = 0.3 and 0.8.",
    .estimators = heavy::kEstimators,
    .parameters = heavy::kParameters,
    .estimator = "classical",
    .any_sampler = false,
    .n = heavy::kN,
    .unit = "samples of a mean",
    .n_least = 2,
    .expected = &heavy::expected,
    .slope = &heavy::slope,
    .evaluations = &heavy::evaluations,
    .rounded = &heavy::rounded,
    .estimate = &heavy::estimate,
};

}  // namespace core::lab
