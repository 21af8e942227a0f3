/// PassPolicy: which samples come next, when a task looks at its error, when it stops.
///
/// Pure: a value made from the settings and the stop rules. It knows neither threads nor clocks nor
/// the film.
#pragma once

#include <limits>

#include "core/error/error_estimate.h"
#include "core/settings/settings.h"

namespace core {

/// Where the tiles of a picture are.
struct Pass {
  int base = 0;    ///< samples of the last complete pass: every tile has as many at least
  int target = 0;  ///< tiles head for it
  /// Can every tile be put back to `base`? Not in a pass that a restart or a new clock rule met
  /// half done: that one is completed first.
  bool base_is_whole = false;
  /// No tile goes beyond before the plan of the next epoch is made.
  int planned_to = std::numeric_limits<int>::max();
};

class PassPolicy {
 public:
  /// samples_limit: of the server, where no rule ends a job before.
  PassPolicy(const RenderSettings& settings, const StopRules& stop, int samples_limit);

  const StopRules& stop() const noexcept { return stop_; }
  bool has_clock() const noexcept {
    return stop_.seconds || stop_.cpu_seconds || stop_.deadline_unix_seconds;
  }
  int samples_max() const noexcept { return samples_max_; }

  /// No tile goes beyond this before every tile is there.
  int barrier(const Pass& pass) const;
  /// Where the pass ends that follows pass.target; pass.target at the barrier.
  int next_target(const Pass& pass) const;
  /// The same where tiles travel to other machines and back for each pass: as few passes as the
  /// looks allow that may end the job, and four times the samples where none may, at the end up to
  /// eight times.
  int far_target(const Pass& pass) const;
  bool looks_at(int samples) const;
  /// The first count at or above `samples` at which an error target may end the job.
  int stop_at(double samples) const;

  /// What is compared with the error target; infinite where nothing is known.
  double error_bound(const ErrorEstimate& look) const;
  /// With what probability a bound may be exceeded at a look.
  double alpha() const;
  /// Is the picture denoised at such a look, to see whether that ends the job?
  bool denoises_at(int samples) const;
  /// After a complete pass of `samples`. bound: error_bound() of a look at them, infinite without
  /// one; denoised_bound: of the denoised picture. kNone: go on.
  StopReason decide(int samples, double relative_rmse, double bound,
                    double denoised_bound = std::numeric_limits<double>::infinity()) const;

 private:
  bool may_stop_at(int samples) const;

  StopRules stop_;
  int replicates_;
  int unit_;
  int samples_max_;
  bool one_by_one_;  ///< samples need a prepass: every tile has one before the next begins
  bool asked_;       ///< samples_max() is what the job asked for
};

}  // namespace core
