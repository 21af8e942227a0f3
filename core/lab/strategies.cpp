// The same irradiance by sampling directions or points on the light, and by combinations of both.

#include "core/lab/experiment_list.h"
#include "core/lab/stage.h"
#include "core/lab/trial.h"
#include "core/sampling/mis.h"
#include "core/sampling/warp.h"

namespace core::lab {
namespace {

/// Combines one weighted sample of each technique.
double combined(const Trial& trial, const Stage& stage, const MisRule& rule) {
  const Stage::Sample light = stage.sample_light(trial.get_4d(kLightGroup));
  const Stage::Sample bsdf = stage.sample_bsdf(trial.get_4d(kBsdfGroup));
  double sum = 0;
  for (const Stage::Sample& s : {light, bsdf}) {
    if (s.pdf_solid_angle > 0) {
      const float weight = rule.weight(static_cast<float>(s.pdf_solid_angle),
                                       static_cast<float>(s.other_pdf_solid_angle));
      sum += ratio(s) * double{weight};
    }
  }
  return sum;
}

namespace strategies {

enum { kUniform, kCosine, kBsdf, kArea, kMis };
enum { kSide };

constexpr std::array kEstimators = {
    EstimatorInfo{"uniform", "none", "Directions uniform over the hemisphere: f cos / (1 / 2 pi)."},
    EstimatorInfo{"cosine", "none", "Directions with density cos / pi."},
    EstimatorInfo{"bsdf", "none", "Directions sampled by the renderer's BSDF."},
    EstimatorInfo{"area", "none", "Points on the light, sampled by the renderer's light sampler."},
    EstimatorInfo{"mis", "none", "One sample of the light and one of the BSDF, power heuristic."},
};
constexpr std::array kParameters = {
    side_parameter(1),
};

double expected(const Setup& setup) { return square_irradiance(setup.parameter(kSide)); }

double evaluations(const Setup& setup, std::int64_t n) {
  return static_cast<double>(n) * (setup.estimator == kMis ? 2 : 1);
}

double estimate(Trial& trial) {
  const Stage stage(trial.parameter(kSide), 0);
  trial.add_cost(evaluations(trial.setup(), trial.n()));
  return mean_of(trial, [&]() -> double {
    const Vec4 u = trial.get_4d(kBsdfGroup);
    const Vec2 direction = {u.y, u.z};
    switch (trial.estimator()) {
      case kUniform:
        return ratio(stage.toward(uniform_hemisphere(direction), 1 / kTwoPi));
      case kCosine: {
        const Vec3 wi = cosine_hemisphere(direction);
        return ratio(stage.toward(wi, cosine_hemisphere_pdf_solid_angle(wi.z)));
      }
      case kBsdf:
        return ratio(stage.sample_bsdf(u));
      case kArea:
        return ratio(stage.sample_light(trial.get_4d(kLightGroup)));
      default:
        return combined(trial, stage, MisRule{});
    }
  });
}

}  // namespace strategies

namespace mis_gamma {

enum { kBalance, kPower, kMaximum, kAverage };
enum { kSide, kExponent };

constexpr std::array kEstimators = {
    EstimatorInfo{"balance", "none", "w = p / (p + q)."},
    EstimatorInfo{"power", "none", "w = p^g / (p^g + q^g), where g is `exponent`."},
    EstimatorInfo{"maximum", "none", "w = 1 where p > q, else 0."},
    EstimatorInfo{
        "average", "none",
        "w = 1/2 everywhere: unbiased, but with much of the variance of the worse technique."},
};
constexpr std::array kParameters = {
    side_parameter(4),
    ParameterInfo{"exponent", 0.25, 64, 2, false, "g of `power`."},
};

double expected(const Setup& setup) { return strategies::expected(setup); }

double evaluations(const Setup& /*setup*/, std::int64_t n) { return 2 * static_cast<double>(n); }

double estimate(Trial& trial) {
  const Stage stage(trial.parameter(kSide), 0);
  MisRule rule;
  rule.exponent = static_cast<float>(trial.parameter(kExponent));
  rule.type = trial.estimator() == kBalance   ? MisType::kBalance
              : trial.estimator() == kMaximum ? MisType::kMaximum
                                              : MisType::kPower;
  trial.add_cost(evaluations(trial.setup(), trial.n()));
  const bool average = trial.estimator() == kAverage;
  return mean_of(trial, [&]() -> double {
    if (average) {
      return 0.5 * (ratio(stage.sample_light(trial.get_4d(kLightGroup))) +
                    ratio(stage.sample_bsdf(trial.get_4d(kBsdfGroup))));
    }
    return combined(trial, stage, rule);
  });
}

}  // namespace mis_gamma
}  // namespace

const Experiment kStrategiesExperiment = {
    .name = "strategies",
    .title = "Sampling strategies",
    .summary = "One integral, five ways to sample it.",
    .estimates =
        "Irradiance from a square light of radiance 1 at distance 1, parallel to the surface.",
    .formula =
        "E = ∫ L cos θ dω = ∫ L V cos θ cos θ′ / r² dA;  estimate 1/n Σ f(xᵢ)/p(xᵢ), variance (∫ "
        "f²/p − E²)/n",
    .look_for =
        "All means agree, but the errors differ: uniform directions waste samples near the horizon "
        "and beside the light, points on a small light waste none. Make the light large: now "
        "cosine sampling wins, and area sampling suffers from 1/r². MIS follows the better of the "
        "two.",
    .estimators = strategies::kEstimators,
    .parameters = strategies::kParameters,
    .estimator = "area",
    .unit = "samples",
    .expected = &strategies::expected,
    .evaluations = &strategies::evaluations,
    .estimate = &strategies::estimate,
};

const Experiment kMisGammaExperiment = {
    .name = "mis-gamma",
    .title = "Multiple importance sampling and its exponent",
    .summary =
        "Two techniques, one sample each; good weights keep the low variance of the better one.",
    .estimates =
        "The same irradiance as in `strategies`, from one light sample and one BSDF sample.",
    .formula = "E ≈ 1/n Σ (w_L f/p_L + w_B f/p_B),  w_L = p_L^γ / (p_L^γ + p_B^γ),  w_L + w_B = 1",
    .look_for =
        "γ = 1 is the balance heuristic, γ = 2 the power heuristic, γ → ∞ the maximum heuristic. "
        "Every choice is unbiased, because the weights sum to 1. Averaging (w = 1/2) keeps a "
        "quarter of the variance of the worse technique, however good the other is; the heuristics "
        "do not. Try sides 0.2 and 10.",
    .estimators = mis_gamma::kEstimators,
    .parameters = mis_gamma::kParameters,
    .estimator = "power",
    .unit = "pairs",
    .expected = &mis_gamma::expected,
    .evaluations = &mis_gamma::evaluations,
    .estimate = &mis_gamma::estimate,
};

}  // namespace core::lab
