// A Markov chain whose states have the density of the integrand.

#include <algorithm>
#include <cmath>

#include "core/lab/experiment_list.h"
#include "core/lab/trial.h"
#include "core/sampling/reservoir.h"

namespace core::lab {
namespace {

enum { kSeeded, kSquare, kAcceptance, kJump, kFromCorner, kRoot, kForgotten };
enum { kLarge, kStep };

constexpr std::array kEstimators = {
    EstimatorInfo{"seeded", "none",
                  "f = 3x^2. As many independent samples as mutations estimate the normalisation; "
                  "the chain starts at one of them, drawn in proportion to f."},
    EstimatorInfo{"square", "none", "The same in two dimensions: f = x + y, h = x y."},
    EstimatorInfo{"acceptance", "none",
                  "Mean probability that a mutation of `seeded` is accepted: small steps alone are "
                  "nearly always, fresh numbers every second time."},
    EstimatorInfo{"jump", "none",
                  "Mean square of the length that a mutation of `seeded` moves, 0 if it is "
                  "rejected: the farther, the less correlated are the states (mixing)."},
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

/// Mean over small steps d, uniform in [-s, s], of d^(2 order) times the integral over x of
/// min(f(x), f(x + d)), for order 0 or 1. By wrapping, the integral is (1 - |d|)^3 + |d|^3.
double small_steps(double s, int order) {
  return order == 0 ? (1 - std::pow(1 - s, 4) + std::pow(s, 4)) / (4 * s)
                    : s * s / 3 - 3 * s * s * s / 4 + 3 * std::pow(s, 4) / 5;
}

/// The integral of f h; that of f is 1. In a chain of density f, a(x -> y) f(x) is min(f(x), f(y)):
/// over the square its integral is 1/2, and that of (y - x)^2 times it 2 B(3, 4) = 1/30.
double expected(const Setup& setup) {
  const double large = setup.parameter(kLarge);
  switch (setup.estimator) {
    case kSquare:
      return 1.0 / 3;
    case kAcceptance:
      return large / 2 + (1 - large) * small_steps(setup.parameter(kStep), 0);
    case kJump:
      return large / 30 + (1 - large) * small_steps(setup.parameter(kStep), 1);
    default:
      return 0.75;
  }
}

bool is_seeded(std::size_t estimator) { return estimator <= kJump; }

double evaluations(const Setup& setup, std::int64_t n) {
  return static_cast<double>(n) * (is_seeded(setup.estimator) ? 2 : 1);
}

double wrapped(double v) { return v - std::floor(v); }

double estimate(Trial& trial) {
  const std::size_t kind = trial.estimator();
  const auto n = static_cast<double>(trial.n());
  trial.add_cost(evaluations(trial.setup(), trial.n()));
  State state = {0.01, 0.01};
  double normalisation = 1;
  if (is_seeded(kind)) {
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
    const bool is_large = double{u.x} < trial.parameter(kLarge);
    const double small = step * (2 * double{u.y} - 1);
    const State next =
        is_large ? State{u.y, u.z}
                 : State{wrapped(state.x + small), wrapped(state.y + step * (2 * double{u.z} - 1))};
    const double ratio = target(kind, next) / std::max(target(kind, state), 1e-30);
    const double move = is_large ? next.x - state.x : small;
    const double chance = std::min(1.0, ratio);
    const bool accepted = double{u.w} < (kind == kRoot ? std::sqrt(ratio) : ratio);
    if (accepted) {
      state = next;
    }
    if (accepted || kind != kForgotten) {
      sum += kind == kAcceptance ? chance
             : kind == kJump     ? chance * move * move
                                 : wanted(kind, state);
      counted += 1;
    }
  }
  return counted > 0 ? normalisation * sum / counted : 0;
}

std::optional<TheorySlope> slope(const Setup& setup) {
  return is_seeded(setup.estimator) ? std::optional(TheorySlope{-0.5}) : std::nullopt;
}

}  // namespace

const Experiment kMetropolisExperiment = {
    .name = "metropolis",
    .title = "Metropolis sampling",
    .summary = "A random walk that visits every place in proportion to the integrand.",
    .estimates =
        "∫ f h, where f is the density of the chain: ∫ 3x² x dx = ¾, or ∫∫ (x + y) x y = ⅓; or "
        "what describes the chain: mean acceptance and mean squared jump.",
    .formula =
        "a(x → y) = min(1, f(y) T(y → x) / (f(x) T(x → y)));  detailed balance: f(x) T(x → y) a(x "
        "→ y) = f(y) T(y → x) a(y → x);  ∫ f h ≈ b/n Σ h(xᵢ), b = ∫ f",
    .look_for =
        "`seeded` chains are unbiased from their first state. A chain that starts in a corner is "
        "off by about its mixing time over n, which vanishes faster than the noise. Small steps "
        "alone mix slowly: set step to 0.01 and large to 0.01; `acceptance` is near 1 then, and "
        "`jump` a thirtieth of what it was. The two wrong chains keep their "
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
