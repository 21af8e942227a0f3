// Analytic knowledge in sampling: expected values and control variates, under a square light.

#include <array>

#include "core/lab/experiment_list.h"
#include "core/lab/stage.h"
#include "core/lab/trial.h"

namespace core::lab {
namespace {

namespace expected_values {

enum { kAnalog, kAbsorption, kNextEvent };
enum { kAlbedo, kSide };

constexpr std::array kEstimators = {
    EstimatorInfo{
        "analog", "none",
        "Every event at random: the path is absorbed or reflected, and hits or misses the light."},
    EstimatorInfo{"absorption", "none",
                  "Absorption as a weight; the light is still hit only by chance."},
    EstimatorInfo{"next-event", "none",
                  "Absorption as a weight, and the light is sampled directly."},
};
constexpr std::array kParameters = {
    ParameterInfo{"albedo", 0.01, 1, 0.5, false, "Fraction of light that the surface reflects."},
    side_parameter(1),
};

double expected(const Setup& setup) {
  return setup.parameter(kAlbedo) * square_irradiance(setup.parameter(kSide));
}

double estimate(Trial& trial) {
  const Stage stage(trial.parameter(kSide), 0);
  const double albedo = trial.parameter(kAlbedo);
  return mean_of(trial, [&]() -> double {
    const Vec4 light = trial.get_4d(kLightGroup);
    if (trial.estimator() == kNextEvent) {
      const Stage::Sample s = stage.sample_light(light);
      return albedo * ratio(s);
    }
    const Stage::Sample s = stage.sample_bsdf(trial.get_4d(kBsdfGroup));
    const double reflected =
        trial.estimator() == kAbsorption ? albedo : (double{light.w} < albedo ? 1.0 : 0.0);
    return reflected * ratio(s);
  });
}

}  // namespace expected_values

namespace control {

enum { kPlain, kUnit, kSame, kCross, kRatio };
enum { kHidden, kSide };

constexpr std::array kEstimators = {
    EstimatorInfo{"plain", "none", "Light sampling alone."},
    EstimatorInfo{"control-variate", "none",
                  "Uses the exact unshadowed irradiance (a = 1); only the shadow is sampled."},
    EstimatorInfo{"same-samples", "consistent",
                  "a = Cov(f, g) / Var(g), computed from the same samples it is applied to."},
    EstimatorInfo{"cross-fitted", "none",
                  "a computed from one half of the samples and applied to the other."},
    EstimatorInfo{
        "ratio", "consistent",
        "Exact unshadowed irradiance times the ratio of the means of f and g (Heitz et al. 2018)."},
};
constexpr std::array kParameters = {
    ParameterInfo{"hidden", 0, 0.9, 0.2, false, "Fraction of the light occluded by an edge."},
    side_parameter(4),
};

double expected(const Setup& setup) {
  return square_irradiance(setup.parameter(kSide), setup.parameter(kHidden));
}

std::int64_t rounded(const Setup& /*setup*/, std::int64_t n) { return n + n % 2; }

/// Sums of a range of samples.
struct Sums {
  double n = 0;
  double f = 0;
  double g = 0;
  double fg = 0;
  double gg = 0;
  void add(double f_over_p, double g_over_p) {
    n += 1;
    f += f_over_p;
    g += g_over_p;
    fg += f_over_p * g_over_p;
    gg += g_over_p * g_over_p;
  }
  double coefficient() const {
    const double variance = gg / n - g / n * (g / n);
    // A control variate without variance, or with less than float rounding, cannot be fitted.
    return variance > 1e-10 * (gg / n) ? (fg / n - f / n * (g / n)) / variance : 0;
  }
  double estimate(double a, double g_exact) const { return f / n - a * (g / n - g_exact); }
};

double estimate(Trial& trial) {
  const Stage stage(trial.parameter(kSide), trial.parameter(kHidden));
  Sums halves[2];
  for (std::int64_t i = 0; i < trial.n(); ++i) {
    if (!trial.start(i)) {
      return 0;
    }
    const Stage::Sample s = stage.sample_light(trial.get_4d(kLightGroup));
    halves[2 * i < trial.n() ? 0 : 1].add(ratio(s), ratio(s.unhidden, s));
  }
  const double g_exact = stage.irradiance_unhidden();
  const Sums& a = halves[0];
  const Sums& b = halves[1];
  const Sums all = {a.n + b.n, a.f + b.f, a.g + b.g, a.fg + b.fg, a.gg + b.gg};
  switch (trial.estimator()) {
    case kPlain:
      return all.f / all.n;
    case kUnit:
      return all.estimate(1, g_exact);
    case kSame:
      return all.estimate(all.coefficient(), g_exact);
    case kCross:
      return 0.5 * (a.estimate(b.coefficient(), g_exact) + b.estimate(a.coefficient(), g_exact));
    default:
      return g_exact * all.f / all.g;
  }
}

std::optional<TheorySlope> slope(const Setup& setup) {
  return setup.estimator == kCross ? std::nullopt : monte_carlo_slope(setup);
}

constexpr std::array<std::int64_t, 7> kN = {4, 16, 64, 256, 1024, 4096, 16384};

}  // namespace control
}  // namespace

const Experiment kExpectedValuesExperiment = {
    .name = "expected-values",
    .title = "Expected values instead of random decisions",
    .summary = "If an expectation can be computed, do not sample it.",
    .estimates =
        "Light reflected by a diffuse surface (albedo times irradiance) under a square light.",
    .formula = "F′ = E[F | x];  Var F = Var F′ + E Var[F | x] ≥ Var F′",
    .look_for =
        "All three slopes are −1/2; each technique has a smaller error than the one before. "
        "analog: π with probability ρE/π; absorption: ρπ with probability E/π; next-event: no path "
        "misses the light.",
    .estimators = expected_values::kEstimators,
    .parameters = expected_values::kParameters,
    .estimator = "analog",
    .unit = "paths",
    .expected = &expected_values::expected,
    .estimate = &expected_values::estimate,
};

const Experiment kControlVariateExperiment = {
    .name = "control-variate",
    .title = "Control variates",
    .summary = "Sample only the difference from a function whose integral is known exactly.",
    .estimates =
        "Irradiance from a square light partly occluded by an edge; without the edge it is known "
        "exactly.",
    .formula =
        "E ≈ a G + 1/n Σ (f − a g)/p,  G = ∫ g;  a* = Cov(f, g) / Var(g);  ratio: G Σf/p / Σg/p",
    .look_for =
        "With hidden = 0 the control variate has no error at all, and with a little shadow it "
        "still wins. With much shadow a = 1 is too large; fitting a to the samples is better but "
        "biased at small n, as is the ratio. Fitting to the other half of the samples removes the "
        "bias.",
    .estimators = control::kEstimators,
    .parameters = control::kParameters,
    .estimator = "control-variate",
    .n = control::kN,
    .unit = "samples",
    .n_least = 4,
    .expected = &control::expected,
    .slope = &control::slope,
    .rounded = &control::rounded,
    .estimate = &control::estimate,
};

}  // namespace core::lab
