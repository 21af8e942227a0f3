/// Runs an experiment: trials at each n, their errors, and a comparison with theory.
///
/// The same (setup, n, replicates, seed) gives the same numbers, bit for bit, for any thread count,
/// except for the measured times `seconds` and `efficiency`.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/lab/experiment.h"
#include "core/math/vec.h"

namespace core::lab {

inline constexpr double kEvaluationsMax = 1e9;
inline constexpr int kReplicatesMax = 4096;
inline constexpr std::int64_t kTrialMax = 100'000'000;
inline constexpr std::size_t kPointsMax = 32;

struct RunOptions {
  std::vector<std::int64_t> n;  ///< each in [n_least, kTrialMax]
  int replicates = 64;          ///< at least 2
  std::uint64_t seed = 0;
  int threads = 1;
};

/// Returns the evaluations of the whole run; the caller bounds it by kEvaluationsMax.
double total_evaluations(const Setup& setup, const RunOptions& options);

struct Point {
  std::int64_t n_asked = 0;
  std::int64_t n = 0;         ///< after rounding
  double mean = 0;            ///< of the replicates
  double rmse = 0;            ///< relative to the exact value
  double standard_error = 0;  ///< of the mean
  double cost = 0;            ///< mean work of a trial; n unless the experiment counts it
  double seconds = 0;         ///< CPU time of all replicates
};

/// agrees: means (of unbiased estimators) and slope match theory; the probability of a false
/// "differs" is 0.2%. biased: an estimator without a known slope shows the bias that it declares.
/// undecided: no prediction, fewer than eight replicates, or too uncertain a slope.
enum class Verdict { kAgrees, kDiffers, kBiased, kUndecided };
std::string_view to_text(Verdict verdict);

struct Interval {
  double low = 0;
  double high = 0;
};

struct Outcome {
  double expected = 0;
  std::optional<double> slope;
  std::optional<double> intercept;         ///< log rmse = intercept + slope log n
  std::optional<Interval> slope_interval;  ///< 95%
  std::optional<double> expected_slope;
  std::optional<double>
      efficiency;  ///< 1 / (relative MSE * CPU seconds of a trial), at the largest n
  std::optional<double> efficiency_by_cost;  ///< the same with counted work instead of seconds
  Verdict verdict = Verdict::kUndecided;
  std::string explanation;
  std::vector<Vec4> pattern;  ///< first points of the first replicate, if the experiment shows them
};

/// Calls on_point after each n, in the order of options.n; if it returns false the run is
/// cancelled. Errors: kCancelled.
Result<Outcome> run(const Setup& setup, const RunOptions& options, const std::stop_token& stop,
                    const std::function<bool(const Point&)>& on_point);

}  // namespace core::lab
