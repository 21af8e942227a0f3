// A Markov chain whose states have the density of the integrand.

#include <algorithm>
#include <cmath>

#include "core/lab/experiment_list.h"
#include "core/lab/trial.h"
#include "core/sampling/reservoir.h"

namespace core::lab {
namespace {

enum { kSeeded, kSquare, kFromCorner, kRoot, kForgotten };
enum { kLarge, kStep };

constexpr std::array kEstimators = {
    EstimatorInfo{"seeded", "none",
                  "f = 3x^2. As many independent samples as mutations estimate the normalisation; "
                  "the chain starts at one of them, drawn in proportion to f."},
    EstimatorInfo{"square", "none", "The same in two dimensions: f = x + y, h = x y."},
    EstimatorInfo{"from-corner", "consistent",
                  "The chain starts where f is nearly 0: its first states do not have density f."},
    EstimatorInfo{"no-balance", "biased",
                  "Deliberately wrong: accepts with the root of the ratio, so states have the "
                  "density of sqrt(f)."},
    EstimatorInfo{"rejections-forgotten", "biased",
                  "Deliberately wrong: a state does not count again when a mutation is rejected."},
};
constexpr std::array kParameters = {
    ParameterInfo{"large", 0.01, 1, 0.3, false,
                  "Probability of a large step: fresh uniform numbers."},
    ParameterInfo{"step", 0.001, 0.5, 0.1, false, "Greatest length of a small step; ends wrap."},
};
constexpr std::array<std::int64_t, 4> kN = {256, 1024, 4096, 16384};

struct State {
  double x = 0;
  double y = 0;
};

double target(std::size_t estimator, State s) {
  return estimator == kSquare ? s.x + s.y : 3 * s.x * s.x;
}
double wanted(std::size_t estimator, State s) { return estimator == kSquare ? s.x * s.y : s.x; }

/// The integral of f h; that of f is 1.
double expected(const Setup& setup) { return setup.estimator == kSquare ? 1.0 / 3 : 0.75; }

double evaluations(const Setup& setup, std::int64_t n) {
  return static_cast<double>(n) * (setup.estimator <= kSquare ? 2 : 1);
}

double wrapped(double v) { return v - std::floor(v); }

double estimate(Trial& trial) {
  const std::size_t kind = trial.estimator();
  const auto n = static_cast<double>(trial.n());
  trial.add_cost(evaluations(trial.setup(), trial.n()));
  State state = {0.01, 0.01};
  double normalisation = 1;
  if (kind <= kSquare) {
    if (!trial.start_at(1, 0)) {
      return 0;
    }
    WeightedReservoir<State> seeds(trial.extra_1d(0));
    for (std::int64_t i = 0; i < trial.n(); ++i) {
      if (!trial.start(i)) {
        return 0;
      }
      const Vec4 u = trial.get_4d(0);
      const State seed = {u.x, u.y};
      seeds.add(seed, target(kind, seed));
    }
    state = seeds.item();
    normalisation = seeds.sum() / n;
  }
  double sum = 0;
  double counted = 0;
  for (std::int64_t i = 0; i < trial.n(); ++i) {
    if (!trial.start_at(2, i)) {
      return 0;
    }
    const Vec4 u = trial.get_4d(0);
    const double step = trial.parameter(kStep);
    const State next = double{u.x} < trial.parameter(kLarge)
                           ? State{u.y, u.z}
                           : State{wrapped(state.x + step * (2 * double{u.y} - 1)),
                                   wrapped(state.y + step * (2 * double{u.z} - 1))};
    const double ratio = target(kind, next) / std::max(target(kind, state), 1e-30);
    const bool accepted = double{u.w} < (kind == kRoot ? std::sqrt(ratio) : ratio);
    if (accepted) {
      state = next;
    }
    if (accepted || kind != kForgotten) {
      sum += wanted(kind, state);
      counted += 1;
    }
  }
  return counted > 0 ? normalisation * sum / counted : 0;
}

std::optional<TheorySlope> slope(const Setup& setup) {
  return setup.estimator <= kSquare ? std::optional(TheorySlope{-0.5}) : std::nullopt;
}

}  // namespace

const Experiment kMetropolisExperiment = {
    .name = "metropolis",
    .title = "Metropolis sampling",
    .summary = "A random walk that visits every place in proportion to the integrand.",
    .estimates =
        "∫ f h, where f is the density of the chain: ∫ 3x² x dx = ¾, or ∫∫ (x + y) x y = ⅓.",
    .formula =
        "a(x → y) = min(1, f(y) T(y → x) / (f(x) T(x → y)));  detailed balance: f(x) T(x → y) a(x "
        "→ y) = f(y) T(y → x) a(y → x);  ∫ f h ≈ b/n Σ h(xᵢ), b = ∫ f",
    .look_for =
        "`seeded` chains are unbiased from their first state. A chain that starts in a corner is "
        "off by about its mixing time over n, which vanishes faster than the noise. Small steps "
        "alone mix slowly: set step to 0.01 and large to 0.01. The two wrong chains keep their "
        "bias: 2/3 in place of 3/4 where the acceptance breaks detailed balance.",
    .estimators = kEstimators,
    .parameters = kParameters,
    .estimator = "seeded",
    .any_sampler = false,
    .n = kN,
    .unit = "mutations",
    .expected = &expected,
    .slope = &slope,
    .evaluations = &evaluations,
    .estimate = &estimate,
};

}  // namespace core::lab
