/// A run of the laboratory: trials at each n, their errors, and whether theory agrees.
///
/// The same (setup, n, replicates, seed) gives the same numbers, bit for bit, for any thread count;
/// only the members that are times, `seconds` and `efficiency`, are measured and differ from run to
/// run.
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

/// Of the whole run; bound it by kEvaluationsMax.
double total_evaluations(const Setup& setup, const RunOptions& options);

struct Point {
  std::int64_t n_asked = 0;
  std::int64_t n = 0;         ///< in force
  double mean = 0;            ///< of the replicates
  double rmse = 0;            ///< against the exact value
  double standard_error = 0;  ///< of the mean
  double cost = 0;            ///< mean work of a trial; n unless the experiment counts
  double seconds = 0;         ///< CPU time of all replicates
};

/// agrees: means (of unbiased estimators) and slope are those of theory; the chance of a wrong
/// "differs" is 0.2 %. biased: an estimator without a known slope whose bias is seen, as it says.
/// undecided: nothing to compare, fewer than eight replicates, or a slope that is known too badly
/// to tell.
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
  std::optional<Interval> slope_interval;  ///< 95 %
  std::optional<double> expected_slope;
  std::optional<double>
      efficiency;  ///< 1 / (relative MSE * CPU seconds of a trial), at the largest n
  std::optional<double> efficiency_by_cost;  ///< the same with counted work for seconds
  Verdict verdict = Verdict::kUndecided;
  std::string explanation;
  std::vector<Vec4>
      pattern;  ///< first points of the first replicate, where the experiment shows them
};

/// Calls on_point after each n, in the order of options.n; false from it cancels. Errors:
/// kCancelled.
Result<Outcome> run(const Setup& setup, const RunOptions& options, const std::stop_token& stop,
                    const std::function<bool(const Point&)>& on_point);

}  // namespace core::lab
