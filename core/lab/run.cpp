#include "core/lab/run.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <span>

#include "core/base/cpu_time.h"
#include "core/base/parallel_for.h"
#include "core/base/statistics.h"
#include "core/lab/fit.h"
#include "core/lab/trial.h"
#include "core/samplers/hash.h"

namespace core::lab {
namespace {

/// Errors below this fraction of the expected value are due to float rounding, not to the
/// estimator.
constexpr double kRounding = 2e-6;
constexpr double kDoubleRounding = 1e-12;
/// Probability of a false "differs" by the means, and of another by the slope.
constexpr double kFalseAlarm = 1e-3;
/// With fewer replicates, discrete estimates are equal too often, and the fit's interval is too
/// short: pi by hits at n = 16 and 64 was rejected in 25% of the runs of two replicates, in 0.7% of
/// those of four, and within the stated rate from eight on.
constexpr int kReplicatesToJudge = 8;
/// A less certain slope agrees with too many predictions: those of random and stratified points are
/// this far apart.
constexpr double kVague = 0.5;
/// Larger numbers of standard errors are clamped.
constexpr double kBeyondDoubt = 1e4;

struct TrialResult {
  double value = 0;
  double cost = 0;
  double seconds = 0;
};

std::vector<TrialResult> run_trials(const Setup& setup, std::int64_t n, const RunOptions& options,
                                    const std::stop_token& stop) {
  std::vector<TrialResult> results(static_cast<std::size_t>(options.replicates));
  parallel_for(options.threads)(options.replicates, [&](int i) {
    if (stop.stop_requested()) {
      return;
    }
    const auto r = static_cast<std::size_t>(i);
    const double start = thread_cpu_seconds();
    const std::uint64_t seed =
        hash_combine(hash_combine(options.seed, static_cast<std::uint64_t>(n)), std::uint64_t{r});
    Trial trial(setup, n, seed, stop);
    const double value = setup.experiment->estimate(trial);
    results[r] = {value, trial.cost(), thread_cpu_seconds() - start};
  });
  return results;
}

/// Results of one n that are kept until the end.
struct Errors {
  Point point;
  double log_variance = 0;
};

Errors summarize(std::span<const TrialResult> results, double expected) {
  Errors out;
  const auto r = static_cast<double>(results.size());
  std::vector<double> squares;
  double sum_squares = 0;
  for (const TrialResult& t : results) {
    out.point.mean += t.value;
    out.point.cost += t.cost;
    out.point.seconds += t.seconds;
    squares.push_back((t.value - expected) * (t.value - expected));
    sum_squares += squares.back();
  }
  out.point.mean /= r;
  out.point.cost /= r;
  double spread = 0;
  for (const TrialResult& t : results) {
    spread += (t.value - out.point.mean) * (t.value - out.point.mean);
  }
  out.point.rmse = std::sqrt(sum_squares / r);
  out.point.standard_error = std::sqrt(spread / (r * (r - 1)));
  out.log_variance = log_rmse_variance(squares);
  return out;
}

const Errors& largest(std::span<const Errors> errors) {
  return *std::max_element(errors.begin(), errors.end(),
                           [](const Errors& a, const Errors& b) { return a.point.n < b.point.n; });
}

bool is_rounding(double error, double expected, double share = kRounding) {
  return error <= share * std::max(std::fabs(expected), 1e-30);
}

/// Quadrature rules use no random numbers and are summed in double, so float rounding does not
/// limit their errors.
bool is_rule(const Setup& setup, const Point& point) {
  return setup.experiment->estimators[setup.estimator].bias != "none" &&
         point.standard_error <= 1e-15 * std::fabs(point.mean);
}

std::string number_text(double value, int digits = 4) {
  char buffer[48];
  std::snprintf(buffer, sizeof buffer, "%.*g", digits, value);
  return buffer;
}

/// The test of the means: the largest deviation from the truth in standard errors, and its limit.
struct MeanCheck {
  bool passed = true;
  std::string text;
};

MeanCheck check_means(std::span<const Errors> errors, double expected, int replicates) {
  const double alpha = 1 - std::pow(1 - kFalseAlarm, 1 / static_cast<double>(errors.size()));
  const double limit = student_t_quantile(1 - alpha / 2, replicates - 1);
  MeanCheck check;
  double worst = 0;
  double spread = 0;
  std::int64_t where = 0;
  for (const Errors& e : errors) {
    const double off = std::fabs(e.point.mean - expected);
    spread = std::max(spread, e.point.standard_error);
    if (is_rounding(off, expected)) {
      continue;
    }
    const double z = e.point.standard_error > 0 ? off / e.point.standard_error : 2 * limit;
    if (z > worst) {
      worst = z;
      where = e.point.n;
    }
  }
  check.passed = worst <= limit;
  if (worst == 0) {
    check.text = "The mean equals the exact value up to rounding.";
  } else if (!(spread > 0)) {
    check.text = "All replicates have the same value, which is not the exact one.";
  } else {
    const std::string far =
        worst < kBeyondDoubt ? number_text(worst, 3) : "more than " + number_text(kBeyondDoubt, 5);
    const std::string chance = number_text(limit, 3) + " can be chance.";
    check.text = check.passed ? "All means lie within " + number_text(worst, 3) +
                                    " standard errors of the exact value; up to " + chance
                              : "The mean at n = " + std::to_string(where) + " is " + far +
                                    " standard errors from the exact value; up to " + chance;
  }
  return check;
}

/// Splits the squared error at the largest n into variance and squared bias.
std::string split_text(const Errors& last, double expected, int replicates) {
  const Point& p = last.point;
  const double bias = p.mean - expected;
  // The mean has a squared standard error V / R; that of R values about their mean is V (R - 1) /
  // R.
  const double variance = p.standard_error * p.standard_error * (replicates - 1);
  return " At n = " + std::to_string(p.n) + " the mean squared error " +
         number_text(p.rmse * p.rmse, 3) + " is the variance " + number_text(variance, 3) +
         " plus the squared bias " + number_text(bias * bias, 3) + ".";
}

void fit(const Setup& setup, std::span<const Errors> errors, int replicates, Outcome& out,
         double& slope_error) {
  std::vector<ErrorAt> points;
  for (const Errors& e : errors) {
    const double rounding = is_rule(setup, e.point) ? kDoubleRounding : kRounding;
    if (!is_rounding(e.point.rmse, out.expected, rounding)) {
      points.push_back({static_cast<double>(e.point.n), e.point.rmse, e.log_variance});
    }
  }
  const bool several = std::any_of(points.begin(), points.end(),
                                   [&](const ErrorAt& p) { return p.n != points.front().n; });
  if (!several) {
    return;
  }
  const SlopeFit line = fit_slope(points);
  const double reach = student_t_quantile(0.975, replicates - 1) * line.standard_error;
  out.slope = line.slope;
  out.intercept = line.intercept;
  out.slope_interval = Interval{line.slope - reach, line.slope + reach};
  slope_error = line.standard_error;
}

void judge(const Setup& setup, std::span<const Errors> errors, int replicates, double slope_error,
           Outcome& out) {
  if (replicates < kReplicatesToJudge) {
    out.explanation =
        "At least " + std::to_string(kReplicatesToJudge) + " replicates are needed for a verdict.";
    return;
  }
  const EstimatorInfo& estimator = setup.experiment->estimators[setup.estimator];
  const MeanCheck means = check_means(errors, out.expected, replicates);
  bool compared = estimator.bias == "none";
  bool agrees = !compared || means.passed;
  bool is_vague = false;
  const bool shows_bias = !compared && !means.passed;
  out.explanation = means.text;
  if (shows_bias) {
    out.explanation += " This estimator is biased" +
                       std::string(estimator.bias == "biased" ? ", as this run shows."
                                                              : " at finite n, as this run shows.");
  }
  if (!compared) {
    out.explanation += split_text(largest(errors), out.expected, replicates);
  }
  if (const auto theory = setup.experiment->slope(setup); out.slope && theory) {
    const double reach =
        student_t_quantile(1 - kFalseAlarm / 2, replicates - 1) * slope_error + theory->tolerance;
    const bool fits = std::fabs(*out.slope - theory->value) <= reach;
    compared = true;
    agrees = agrees && fits;
    const bool is_exact = std::all_of(errors.begin(), errors.end(),
                                      [&](const Errors& e) { return is_rule(setup, e.point); });
    is_vague = fits && !is_exact && reach > kVague;
    out.explanation += " The slope is " + number_text(*out.slope, 3) + "; theory predicts " +
                       number_text(theory->value, 3);
    if (is_vague) {
      out.explanation +=
          ". It is known only within " + number_text(reach, 2) +
          ", too uncertain for a verdict: use more replicates or a wider range of n.";
    } else if (fits) {
      out.explanation += "; they agree within " + number_text(reach, 2) + ".";
    } else {
      out.explanation += "; they differ by more than chance, " + number_text(reach, 2) + ".";
    }
  }
  if (!agrees) {
    out.verdict = Verdict::kDiffers;
  } else if (is_vague) {
    out.verdict = Verdict::kUndecided;
  } else if (compared) {
    out.verdict = Verdict::kAgrees;
  } else {
    out.verdict = shows_bias ? Verdict::kBiased : Verdict::kUndecided;
  }
}

void add_efficiency(std::span<const Errors> errors, int replicates, Outcome& out) {
  const Point& last = largest(errors).point;
  const double relative = last.rmse / std::fabs(out.expected);
  if (!(relative > 0) || std::isinf(relative)) {
    return;
  }
  const double seconds = last.seconds / replicates;
  if (seconds > 0) {
    out.efficiency = 1 / (relative * relative * seconds);
  }
  out.efficiency_by_cost = 1 / (relative * relative * last.cost);
}

std::vector<Vec4> pattern_of(const Setup& setup, const RunOptions& options,
                             const std::stop_token& stop) {
  constexpr std::int64_t kShown = 1024;
  std::vector<Vec4> points;
  if (setup.experiment->pattern_dimensions == 0) {
    return points;
  }
  // The largest set that can be shown as a whole; else the beginning of the smallest.
  std::int64_t asked = *std::min_element(options.n.begin(), options.n.end());
  for (const std::int64_t n : options.n) {
    if (rounded_n(setup, n) <= kShown && n > asked) {
      asked = n;
    }
  }
  const std::int64_t n = rounded_n(setup, asked);
  const std::uint64_t seed =
      hash_combine(hash_combine(options.seed, static_cast<std::uint64_t>(n)), 0);
  Trial trial(setup, n, seed, stop);
  for (std::int64_t i = 0; i < std::min(n, kShown); ++i) {
    trial.start(i);
    const auto shown = setup.experiment->shown;
    points.push_back(shown != nullptr ? shown(trial) : trial.get_4d(0));
  }
  return points;
}

}  // namespace

std::string_view to_text(Verdict verdict) {
  switch (verdict) {
    case Verdict::kAgrees:
      return "agrees";
    case Verdict::kDiffers:
      return "differs";
    case Verdict::kBiased:
      return "biased";
    case Verdict::kUndecided:
      break;
  }
  return "undecided";
}

double total_evaluations(const Setup& setup, const RunOptions& options) {
  double total = 0;
  for (const std::int64_t n : options.n) {
    total += trial_evaluations(setup, rounded_n(setup, n)) * options.replicates;
  }
  return total;
}

Result<Outcome> run(const Setup& setup, const RunOptions& options, const std::stop_token& stop,
                    const std::function<bool(const Point&)>& on_point) {
  CHECK(!options.n.empty() && options.replicates >= 2);
  const Error cancelled = {ErrorCode::kCancelled, "the run was cancelled", ""};
  Outcome out;
  out.expected = setup.experiment->expected(setup);
  if (const auto theory = setup.experiment->slope(setup)) {
    out.expected_slope = theory->value;
  }
  std::vector<Errors> errors;
  for (const std::int64_t asked : options.n) {
    const std::int64_t n = rounded_n(setup, asked);
    const std::vector<TrialResult> results = run_trials(setup, n, options, stop);
    if (stop.stop_requested()) {
      return cancelled;
    }
    errors.push_back(summarize(results, out.expected));
    errors.back().point.n_asked = asked;
    errors.back().point.n = n;
    if (!on_point(errors.back().point)) {
      return cancelled;
    }
  }
  double slope_error = 0;
  fit(setup, errors, options.replicates, out, slope_error);
  judge(setup, errors, options.replicates, slope_error, out);
  add_efficiency(errors, options.replicates, out);
  out.pattern = pattern_of(setup, options, stop);
  return out;
}

}  // namespace core::lab
