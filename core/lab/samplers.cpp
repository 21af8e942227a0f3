// Every sampler of the registry on integrands that distinguish them, in two and four dimensions.

#include <cmath>
#include <numbers>

#include "core/lab/experiment_list.h"
#include "core/lab/trial.h"

namespace core::lab {
namespace {

double arch(double x) { return 0.5 * std::numbers::pi * std::sin(std::numbers::pi * x); }

/// Independent pairs, and independent sets of eight points in each pixel.
bool is_sets_of_few(std::string_view sampler) {
  return sampler == "antithetic" || sampler == "zsobol";
}

constexpr TheorySlope kHalf = {-0.5};
constexpr TheorySlope kNet = {-1.5, 0.2};  ///< times powers of log n

namespace two {

enum { kSmooth, kEdge, kAdditive };

constexpr std::array kEstimators = {
    EstimatorInfo{"smooth", "none", "(pi/2)^2 sin(pi x) sin(pi y): both axes interact."},
    EstimatorInfo{"edge", "none", "1 where x^2 + y^2 < 1: a curved edge, like that of a shadow."},
    EstimatorInfo{"additive", "none", "(pi/4) (sin(pi x) + sin(pi y)): no interaction."},
};

double expected(const Setup& setup) { return setup.estimator == kEdge ? std::numbers::pi / 4 : 1; }

std::optional<TheorySlope> slope(const Setup& setup) {
  const std::string_view s = setup.sampler_name;
  const std::size_t f = setup.estimator;
  if (s == "independent" || is_sets_of_few(s)) {
    return kHalf;
  }
  if (s == "sobol") {
    return f == kEdge ? TheorySlope{-0.75} : kNet;
  }
  if (s == "stratified") {
    return f == kEdge ? TheorySlope{-0.75} : TheorySlope{-1.0};
  }
  if (s == "latin-hypercube") {
    return f == kAdditive ? TheorySlope{-1.5} : kHalf;
  }
  if (s == "orthogonal-array") {
    return f == kEdge ? TheorySlope{-0.75, 0.1}
                      : (f == kSmooth ? TheorySlope{-1.0, 0.1} : TheorySlope{-1.5, 0.1});
  }
  return std::nullopt;
}

double estimate(Trial& trial) {
  return mean_of(trial, [&]() -> double {
    const Vec4 u = trial.get_4d(0);
    const double x = u.x;
    const double y = u.y;
    switch (trial.estimator()) {
      case kSmooth:
        return arch(x) * arch(y);
      case kEdge:
        return x * x + y * y < 1 ? 1 : 0;
      default:
        return 0.5 * (arch(x) + arch(y));
    }
  });
}

}  // namespace two

namespace four {

enum { kAdditive, kPairwise, kProduct, kBall };

constexpr std::array kEstimators = {
    EstimatorInfo{"additive", "none", "Mean of four arches (pi/2) sin(pi x), one per axis."},
    EstimatorInfo{"pairwise", "none",
                  "Mean of the products of two arches over all six pairs of axes."},
    EstimatorInfo{"product", "none", "Product of the four arches: all axes interact."},
    EstimatorInfo{"ball", "none", "1 inside the unit ball: an edge in four dimensions."},
};

double expected(const Setup& setup) {
  return setup.estimator == kBall ? std::numbers::pi * std::numbers::pi / 32 : 1;
}

std::optional<TheorySlope> slope(const Setup& setup) {
  const std::string_view s = setup.sampler_name;
  const std::size_t f = setup.estimator;
  if (s == "independent" || is_sets_of_few(s)) {
    return kHalf;
  }
  if (s == "sobol") {
    return f == kBall ? TheorySlope{-0.625} : (f == kProduct ? TheorySlope{-1.5, 0.5} : kNet);
  }
  if (s == "latin-hypercube") {
    return f == kAdditive ? TheorySlope{-1.5} : kHalf;
  }
  if (s == "orthogonal-array") {
    return f == kAdditive   ? std::optional(TheorySlope{-1.5, 0.1})
           : f == kPairwise ? std::optional(TheorySlope{-1.0, 0.1})
                            : std::nullopt;
  }
  return std::nullopt;
}

double estimate(Trial& trial) {
  return mean_of(trial, [&]() -> double {
    const Vec4 u = trial.get_4d(0);
    if (trial.estimator() == kBall) {
      const auto square = [](double x) { return x * x; };
      const double r2 = square(u.x) + square(u.y) + square(u.z) + square(u.w);
      return r2 < 1 ? 1 : 0;
    }
    const double a = arch(u.x);
    const double b = arch(u.y);
    const double c = arch(u.z);
    const double d = arch(u.w);
    switch (trial.estimator()) {
      case kAdditive:
        return (a + b + c + d) / 4;
      case kPairwise:
        return (a * b + a * c + a * d + b * c + b * d + c * d) / 6;
      default:
        return a * b * c * d;
    }
  });
}

}  // namespace four
}  // namespace

const Experiment kSamplers2dExperiment = {
    .name = "samplers-2d",
    .title = "Samplers in two dimensions",
    .summary = "Estimate the same integral with increasingly well-distributed points.",
    .estimates =
        "The integral of a smooth, a discontinuous or an additive function over the unit square.",
    .formula =
        "1/n Σ f(xᵢ);  independent n^(−1/2), stratified n^(−1) smooth and n^(−3/4) across an edge, "
        "Owen-scrambled Sobol n^(−3/2) and n^(−3/4)",
    .look_for =
        "Compare the points first: independent points have clumps and gaps, stratified ones have "
        "one point in each cell, a Latin hypercube has one in each row and column. Sampling "
        "reduces only the variance along what it stratifies: Latin hypercubes win only on additive "
        "functions. Here a run uses one set of n points; zsobol distributes its points over "
        "neighbouring pixels, and within one pixel it uses independent sets of eight.",
    .estimators = two::kEstimators,
    .estimator = "smooth",
    .sampler = "sobol",
    .unit = "points",
    .pattern_dimensions = 2,
    .expected = &two::expected,
    .slope = &two::slope,
    .estimate = &two::estimate,
};

const Experiment kSamplers4dExperiment = {
    .name = "samplers-4d",
    .title = "Samplers in four dimensions",
    .summary =
        "A film position and a lens position have four dimensions; which interactions does each "
        "sampler stratify?",
    .estimates =
        "The integral over the four-dimensional unit cube of functions with increasing "
        "interaction.",
    .formula =
        "1/n Σ f(xᵢ);  additive: n^(−3/2) for Latin hypercubes, pairwise: n^(−1) for orthogonal "
        "arrays, product: n^(−3/2) times logarithms for Sobol, ball: n^(−5/8)",
    .look_for =
        "Latin hypercubes help with additive functions, orthogonal arrays of strength 2 with pairs "
        "of axes, Sobol points with all of them. At the edge of the ball all samplers are close to "
        "independent points, because in four dimensions the edge cuts most cells.",
    .estimators = four::kEstimators,
    .estimator = "pairwise",
    .sampler = "sobol",
    .unit = "points",
    .pattern_dimensions = 4,
    .expected = &four::expected,
    .slope = &four::slope,
    .estimate = &four::estimate,
};

}  // namespace core::lab
