// Walks of random length: the error that roulette and splitting leave for the steps they cost.

#include <algorithm>
#include <vector>

#include "core/lab/experiment_list.h"
#include "core/lab/trial.h"
#include "core/transport/roulette.h"

namespace core::lab {
namespace {

enum { kConstant, kProportional, kRenderer, kCutOff, kForgotten };
enum { kProbability, kFactor };

constexpr double kBright = 0.9;
constexpr double kDark = 0.1;
constexpr int kCutOffAfter = 4;
constexpr std::array kEstimators = {
    EstimatorInfo{"constant", "none",
                  "Continues with the same probability q at dark and bright surfaces."},
    EstimatorInfo{"proportional", "none",
                  "Continues `factor` times albedo times on average: roulette below 1, splitting "
                  "above."},
    EstimatorInfo{"renderer", "none", "The renderer's probability, from the path's throughput."},
    EstimatorInfo{"cut-off", "biased", "Deliberately wrong: ends every walk after four surfaces."},
    EstimatorInfo{"forgotten", "biased",
                  "Deliberately wrong: as `constant`, without dividing by q."},
};
constexpr std::array kParameters = {
    ParameterInfo{"probability", 0.5, 0.95, 0.75, false, "q of `constant`."},
    ParameterInfo{"factor", 0.5, 1.8, 1.1, false, "Factor of `proportional`."},
};

/// Every surface emits 1 and has albedo 0.9 or 0.1, each half of the time: L = 1 + L / 2.
double expected(const Setup& /*setup*/) { return 2; }

double evaluations(const Setup& setup, std::int64_t n) {
  const double again = setup.estimator == kProportional ? setup.parameter(kFactor) / 2
                                                        : setup.parameter(kProbability);
  return static_cast<double>(n) / (1 - again);
}

struct Walk {
  double throughput = 1;
  int surfaces = 0;
};

/// Returns the mean number of continuations of a walk behind a surface.
double continuations(const Trial& trial, const Walk& walk, double albedo) {
  switch (trial.estimator()) {
    case kProportional:
      return trial.parameter(kFactor) * albedo;
    case kRenderer: {
      const auto left = static_cast<float>(walk.throughput * albedo);
      const float lambert = 0.25F;  // a density of directions [1/sr]
      return std::min(1.0F, continuation_probability(left, lambert));
    }
    case kCutOff:
      return walk.surfaces < kCutOffAfter ? 1 : 0;
    default:
      return trial.parameter(kProbability);
  }
}

double estimate(Trial& trial) {
  std::vector<Walk> open;
  return mean_of(trial, [&] {
    double sum = 0;
    std::uint32_t number = 0;
    open.assign(1, {});
    while (!open.empty()) {
      Walk walk = open.back();
      open.pop_back();
      trial.add_cost(1);
      sum += walk.throughput;
      ++walk.surfaces;
      const double albedo = trial.extra_1d(number++) < 0.5F ? kBright : kDark;
      const double mean = continuations(trial, walk, albedo);
      walk.throughput *= trial.estimator() == kForgotten ? albedo : albedo / mean;
      const auto count = static_cast<int>(mean + double{trial.extra_1d(number++)});
      open.insert(open.end(), static_cast<std::size_t>(count), walk);
    }
    return sum;
  });
}

}  // namespace

const Experiment kRouletteEfficiencyExperiment = {
    .name = "roulette-efficiency",
    .title = "Efficiency of roulette and splitting",
    .summary = "Neither lowers the error of a walk; both can lower the error for the same work.",
    .estimates =
        "Radiance in a closed room whose surfaces emit 1 and have albedo 0.9 or 0.1 by chance: L = "
        "1 + L/2 = 2.",
    .formula =
        "efficiency = 1 / (V · cost);  constant q: V = (1 + 2mμ)/(1 − E[A²]/q) − μ², cost = 1/(1 − "
        "q);  factor c: V = V[N] μ²/c² / (1 − m/c), cost = 1/(1 − c m);  m = ½, μ = 2",
    .look_for =
        "Compare the efficiency by cost. A constant q ends bright and dark walks alike: its best "
        "value, near 0.75, has the V · cost 10.5. With q = albedo (factor 1) the throughput stays "
        "1 and V · cost is 4; with factor 1.11 no bright walk is ended, and it is 3.3; beyond, "
        "walks split and the cost grows faster than the variance falls. `cut-off` saves work and "
        "loses light.",
    .estimators = kEstimators,
    .parameters = kParameters,
    .estimator = "proportional",
    .any_sampler = false,
    .unit = "walks",
    .expected = &expected,
    .evaluations = &evaluations,
    .estimate = &estimate,
};

}  // namespace core::lab
