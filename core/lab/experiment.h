/// Experiment: one textbook question about estimators, asked of the renderer's own classes.
///
/// A trial is one independent replicate: from n evaluations (what one evaluation is, each
/// experiment says) it makes one estimate of a number that is known exactly. run.h repeats trials
/// and measures how wrong they are.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "core/settings/settings.h"

namespace core::lab {

class Trial;

/// bias: "none", "consistent" (falls with n) or "biased" (stays).
struct EstimatorInfo {
  std::string_view name;
  std::string_view bias;
  std::string_view summary;
};

struct ParameterInfo {
  std::string_view name;
  double min = 0;
  double max = 0;
  double standard = 0;  ///< the default
  bool is_whole = false;
  std::string_view summary;
};

/// Slope of log RMSE over log n for large n, and how far that of a run at finite n may be from it.
struct TheorySlope {
  double value = 0;
  double tolerance = 0.06;
};

struct Experiment;

/// The settings of a run. The caller checks them.
struct Setup {
  const Experiment* experiment = nullptr;
  std::size_t estimator = 0;  ///< index into Experiment::estimators
  SamplerType sampler = SamplerType::kIndependent;
  std::string_view sampler_name = "independent";
  std::vector<double> parameters;  ///< one for each of Experiment::parameters

  double parameter(std::size_t i) const { return parameters[i]; }
  int whole(std::size_t i) const { return static_cast<int>(parameters[i]); }
  std::string_view estimator_name() const;
};

struct Experiment {
  std::string_view name;
  std::string_view title;
  std::string_view summary;
  std::string_view estimates;  ///< the quantity
  std::string_view formula;
  std::string_view look_for;  ///< what to observe
  std::span<const EstimatorInfo> estimators;
  std::span<const ParameterInfo> parameters;
  std::string_view estimator;  ///< default
  std::string_view sampler;    ///< default; the only one unless any_sampler
  bool any_sampler = true;
  std::span<const std::int64_t> n;  ///< default
  std::string_view unit;            ///< what n counts
  std::int64_t n_least = 1;
  int pattern_dimensions = 0;  ///< of the points shown with the result; 0: none

  double (*expected)(const Setup& setup) = nullptr;
  /// The prediction of theory; empty where there is none.
  std::optional<TheorySlope> (*slope)(const Setup& setup) = nullptr;
  /// Random vectors that a trial of n uses, for the bound on a whole run; null: n.
  double (*evaluations)(const Setup& setup, std::int64_t n) = nullptr;
  /// n under the rule of the estimator; null: the sampler's rule alone.
  std::int64_t (*rounded)(const Setup& setup, std::int64_t n) = nullptr;
  double (*estimate)(Trial& trial) = nullptr;
};

/// All of them, in the order in which they teach.
std::span<const Experiment* const> experiments();
/// Null when there is none.
const Experiment* find_experiment(std::string_view name);

/// The default estimator, sampler and parameters.
Setup default_setup(const Experiment& experiment);
/// False when this build or this experiment has no such name.
bool choose_estimator(Setup& setup, std::string_view name);
bool choose_sampler(Setup& setup, std::string_view name);
/// Samplers that the experiment takes, from the registry.
std::vector<std::string_view> allowed_samplers(const Experiment& experiment);

/// n in force: the estimator's rule, then the sampler's.
std::int64_t rounded_n(const Setup& setup, std::int64_t n);
/// Of one trial.
double trial_evaluations(const Setup& setup, std::int64_t n);

}  // namespace core::lab
