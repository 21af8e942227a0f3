/// ProgressMeter: records the errors and times of a task and estimates the remaining work. Not
/// thread-safe.
#pragma once

#include <vector>

#include "core/render/task/eta.h"
#include "core/render/task/pass_policy.h"
#include "core/render/task/progress.h"

namespace core {

class ProgressMeter {
 public:
  explicit ProgressMeter(std::vector<ConvergencePoint> before) : points_(std::move(before)) {}

  const std::vector<ConvergencePoint>& points() const noexcept { return points_; }
  ErrorInterval error() const;  ///< from the last estimate; NaN before the first
  /// Records a complete pass after `elapsed_seconds` of rendering.
  void note_pass(int samples, double elapsed_seconds);
  /// bound: PassPolicy::error_bound().
  void note_check(const ConvergencePoint& point, double bound);
  void forget_fraction() { fraction_ = 0; }  ///< call when the stop rules have changed

  /// Fills fraction, ETA and error of `p`; its other members are already set. samples: current mean
  /// over the film. base: samples of the last complete pass.
  void tell(const PassPolicy& policy, double samples, int base, bool is_over, Progress& p);

 private:
  Remaining samples_at_end(const PassPolicy& policy, int base) const;
  std::vector<ConvergencePoint> points_;
  std::vector<PacePoint> pace_;  ///< the last passes of this run
  double bound_ = 0;             ///< last bound compared with the error target; 0: none yet
  double fraction_ = 0;          ///< last reported value
};

}  // namespace core
