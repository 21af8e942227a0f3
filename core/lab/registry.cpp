
#include <algorithm>
#include <array>

#include "core/base/check.h"
#include "core/lab/experiment_list.h"
#include "core/lab/trial.h"
#include "core/settings/choices.h"

namespace core::lab {
namespace {

constexpr std::array kExperiments = {&kPiExperiment,
                                     &kMseExperiment,
                                     &kQuadratureExperiment,
                                     &kInversionExperiment,
                                     &kRenderingEquationExperiment,
                                     &kStrategiesExperiment,
                                     &kMisGammaExperiment,
                                     &kOptimalMisExperiment,
                                     &kInfiniteVarianceExperiment,
                                     &kRouletteExperiment,
                                     &kSplittingExperiment,
                                     &kRouletteEfficiencyExperiment,
                                     &kExpectedValuesExperiment,
                                     &kControlVariateExperiment,
                                     &kRegressionExperiment,
                                     &kAntitheticExperiment,
                                     &kDiscrepancyExperiment,
                                     &kSamplers2dExperiment,
                                     &kSamplers4dExperiment,
                                     &kRisExperiment,
                                     &kReservoirExperiment,
                                     &kReservoirMergeExperiment,
                                     &kRestirExperiment,
                                     &kPathIntegralExperiment,
                                     &kMetropolisExperiment,
                                     &kDensityEstimationExperiment,
                                     &kPpmExperiment,
                                     &kIrradianceCacheExperiment,
                                     &kStoppingExperiment};

}  // namespace

std::string_view Setup::estimator_name() const { return experiment->estimators[estimator].name; }

std::span<const Experiment* const> experiments() { return kExperiments; }

const Experiment* find_experiment(std::string_view name) {
  const auto found = std::find_if(kExperiments.begin(), kExperiments.end(),
                                  [name](const Experiment* e) { return e->name == name; });
  return found == kExperiments.end() ? nullptr : *found;
}

Setup default_setup(const Experiment& experiment) {
  Setup setup;
  setup.experiment = &experiment;
  for (const ParameterInfo& p : experiment.parameters) {
    setup.parameters.push_back(p.standard);
  }
  CHECK(choose_estimator(setup, experiment.estimator));
  CHECK(choose_sampler(setup, experiment.sampler));
  return setup;
}

bool choose_estimator(Setup& setup, std::string_view name) {
  const auto& all = setup.experiment->estimators;
  const auto found = std::find_if(all.begin(), all.end(),
                                  [name](const EstimatorInfo& e) { return e.name == name; });
  if (found == all.end()) {
    return false;
  }
  setup.estimator = static_cast<std::size_t>(found - all.begin());
  return true;
}

std::vector<std::string_view> allowed_samplers(const Experiment& experiment) {
  std::vector<std::string_view> names;
  for (const auto& entry : samplers()) {
    if (experiment.any_sampler || entry.name == experiment.sampler) {
      names.push_back(entry.name);
    }
  }
  return names;
}

bool choose_sampler(Setup& setup, std::string_view name) {
  if (!setup.experiment->any_sampler && name != setup.experiment->sampler) {
    return false;
  }
  for (const auto& entry : samplers()) {
    if (entry.name == name) {
      setup.sampler = entry.value;
      setup.sampler_name = entry.name;
      return true;
    }
  }
  return false;
}

std::int64_t rounded_n(const Setup& setup, std::int64_t n) {
  const Experiment& e = *setup.experiment;
  n = std::max(n, e.n_least);
  if (e.rounded != nullptr) {
    n = e.rounded(setup, n);
  }
  return e.any_sampler ? Trial::rounded(setup.sampler, n) : n;
}

double trial_evaluations(const Setup& setup, std::int64_t n) {
  const auto own = setup.experiment->evaluations;
  return own != nullptr ? own(setup, n) : static_cast<double>(n);
}

std::optional<TheorySlope> monte_carlo_slope(const Setup& setup) {
  if (setup.sampler_name != "independent" ||
      setup.experiment->estimators[setup.estimator].bias != "none") {
    return std::nullopt;
  }
  return TheorySlope{-0.5};
}

}  // namespace core::lab
