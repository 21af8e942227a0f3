/// PassPolicy: decides which samples come next, when to check the error, and when to stop.
///
/// A pure value computed from the settings and the stop rules. It does not depend on threads,
/// clocks or the film.
#pragma once

#include <limits>

#include "core/error/error_estimate.h"
#include "core/settings/settings.h"

namespace core {

/// Progress of the tiles through passes.
struct Pass {
  int base = 0;    ///< samples of the last complete pass: every tile has at least as many
  int target = 0;  ///< samples of every tile at the end of this pass
  /// Whether every tile can be reset to `base`. False if a restart or a new clock rule interrupted
  /// the pass; the pass is then completed first.
  bool base_is_whole = false;
  /// Limit for all tiles until the next epoch is planned.
  int planned_to = std::numeric_limits<int>::max();
};

class PassPolicy {
 public:
  /// samples_limit: limit of the server, for jobs that no rule ends earlier.
  PassPolicy(const RenderSettings& settings, const StopRules& stop, int samples_limit);

  const StopRules& stop() const noexcept { return stop_; }
  bool has_clock() const noexcept {
    return stop_.seconds || stop_.cpu_seconds || stop_.deadline_unix_seconds;
  }
  int samples_max() const noexcept { return samples_max_; }

  /// Returns the count that no tile may exceed until every tile has reached it.
  int barrier(const Pass& pass) const;
  /// Returns the end of the pass after pass.target; pass.target itself at the barrier.
  int next_target(const Pass& pass) const;
  /// As next_target(), for tiles that are sent to other machines and back in each pass. Minimises
  /// the number of passes: the next pass ends at the next check that may end the job, or at four
  /// times the samples if there is none (up to eight times for the last pass).
  int far_target(const Pass& pass) const;
  bool checks_at(int samples) const;
  /// Returns the first count at or above `samples` at which an error target may end the job.
  int stop_at(double samples) const;

  /// Returns the upper end that is compared with the error target; NaN if unknown.
  double error_bound(const ErrorEstimate& check) const;
  /// Returns whether so little light may be missing that an error target may end the job.
  /// at_most: LightNotFound::at_most.
  bool allows_missing(double at_most) const {
    return !stop_.light_not_found || at_most <= *stop_.light_not_found;
  }
  /// Returns whether the meter's error ends the job after this pass. error: meter_error().
  bool ends_by_meter(int samples, double error) const {
    return stop_.meter_error && may_stop_at(samples) && error <= *stop_.meter_error;
  }
  /// Returns whether the image is denoised at this check to test the stop rule.
  bool denoises_at(int samples) const;
  /// Decides after a complete pass of `samples`. bound: error_bound() of the check at that count,
  /// infinite if there was none. denoised_bound: that of the denoised image. at_most: as of
  /// allows_missing(). Returns kNone to continue.
  StopReason decide(int samples, double bound,
                    double denoised_bound = std::numeric_limits<double>::infinity(),
                    double at_most = std::numeric_limits<double>::infinity()) const;

 private:
  bool may_stop_at(int samples) const;

  StopRules stop_;
  int replicates_;
  int unit_;
  int samples_max_;
  bool one_by_one_;  ///< samples need a prepass: every tile gets one sample before the next sample
                     ///< begins
  bool asked_;       ///< the job set samples_max() itself
};

}  // namespace core
