/// Experiment: a textbook question about estimators, answered with the renderer's own classes.
///
/// A trial is one independent replicate: from n evaluations (defined by the experiment) it
/// estimates a number with a known exact value. run.h repeats trials and measures their errors.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "core/math/vec.h"
#include "core/settings/settings.h"

namespace core::lab {

class Trial;

/// bias: "none", "consistent" (decreases with n) or "biased" (does not).
struct EstimatorInfo {
  std::string_view name;
  std::string_view bias;
  std::string_view summary;
};

struct ParameterInfo {
  std::string_view name;
  double min = 0;
  double max = 0;
  double standard = 0;  ///< default
  bool is_whole = false;
  std::string_view summary;
};

/// Slope of log RMSE over log n for large n, and the allowed deviation of a run at finite n.
struct TheorySlope {
  double value = 0;
  double tolerance = 0.06;
};

struct Experiment;

/// Settings of a run; validated by the caller.
struct Setup {
  const Experiment* experiment = nullptr;
  std::size_t estimator = 0;  ///< index into Experiment::estimators
  SamplerType sampler = SamplerType::kIndependent;
  std::string_view sampler_name = "independent";
  std::vector<double> parameters;  ///< one per entry of Experiment::parameters

  double parameter(std::size_t i) const { return parameters[i]; }
  int whole(std::size_t i) const { return static_cast<int>(parameters[i]); }
  std::string_view estimator_name() const;
};

/// Powers of four, which every sampler uses unchanged or nearly so.
inline constexpr std::array<std::int64_t, 6> kPowersOfFour = {16, 64, 256, 1024, 4096, 16384};

/// Returns the slope -1/2 if samples are independent and the estimator unbiased.
std::optional<TheorySlope> monte_carlo_slope(const Setup& setup);

struct Experiment {
  std::string_view name;
  std::string_view title;
  std::string_view summary;
  std::string_view estimates;  ///< the estimated quantity
  std::string_view formula;
  std::string_view look_for;  ///< what to observe
  std::span<const EstimatorInfo> estimators;
  std::span<const ParameterInfo> parameters = {};
  std::string_view estimator;                ///< default
  std::string_view sampler = "independent";  ///< default; the only one unless any_sampler
  bool any_sampler = true;
  std::span<const std::int64_t> n = kPowersOfFour;  ///< default
  std::string_view unit;                            ///< the unit of n
  std::int64_t n_least = 1;
  int pattern_dimensions = 0;  ///< of the points shown with the result; 0: none shown

  double (*expected)(const Setup& setup) = nullptr;
  /// Returns the theoretical slope; empty if there is none.
  std::optional<TheorySlope> (*slope)(const Setup& setup) = &monte_carlo_slope;
  /// Returns the number of random vectors of a trial of n, for the bound on a whole run; null: n.
  double (*evaluations)(const Setup& setup, std::int64_t n) = nullptr;
  /// Rounds n by the rule of the estimator; null: only the sampler's rule applies.
  std::int64_t (*rounded)(const Setup& setup, std::int64_t n) = nullptr;
  double (*estimate)(Trial& trial) = nullptr;
  /// Returns the point to show for the current evaluation, in [0,1]^4; null: its random numbers.
  Vec4 (*shown)(const Trial& trial) = nullptr;
};

/// Returns all experiments in teaching order.
std::span<const Experiment* const> experiments();
/// Returns null if there is no such experiment.
const Experiment* find_experiment(std::string_view name);

/// Returns the default estimator, sampler and parameters.
Setup default_setup(const Experiment& experiment);
/// Returns false if this build or this experiment has no estimator of that name.
bool choose_estimator(Setup& setup, std::string_view name);
bool choose_sampler(Setup& setup, std::string_view name);
/// Returns the samplers that the experiment supports, from the registry.
std::vector<std::string_view> allowed_samplers(const Experiment& experiment);

/// Returns n rounded by the estimator's rule, then the sampler's.
std::int64_t rounded_n(const Setup& setup, std::int64_t n);
/// Returns the evaluations of one trial.
double trial_evaluations(const Setup& setup, std::int64_t n);

}  // namespace core::lab
