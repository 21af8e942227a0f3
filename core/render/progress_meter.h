/// ProgressMeter: errors and times that a task has measured, and how much is left. Not thread-safe.
#pragma once

#include <vector>

#include "core/render/eta.h"
#include "core/render/pass_policy.h"
#include "core/render/progress.h"

namespace core {

class ProgressMeter {
 public:
  explicit ProgressMeter(std::vector<ConvergencePoint> before) : points_(std::move(before)) {}

  const std::vector<ConvergencePoint>& points() const noexcept { return points_; }
  ErrorInterval error() const;  ///< of the last estimate; NaN before
  /// A complete pass, after so many seconds of rendering.
  void note_pass(int samples, double elapsed_seconds);
  /// bound: PassPolicy::error_bound().
  void note_look(const ConvergencePoint& point, double bound);
  void forget_fraction() { fraction_ = 0; }  ///< the stop rules have changed

  /// Fills fraction, ETA and error of `p`, which has the other members. samples: mean
  /// over the film as its tiles are; base: of the last complete pass.
  void tell(const PassPolicy& policy, double samples, int base, bool is_over, Progress& p);

 private:
  Remaining samples_at_end(const PassPolicy& policy, int base) const;
  std::vector<ConvergencePoint> points_;
  std::vector<PacePoint> pace_;  ///< of the last passes of this run
  double bound_ = 0;             ///< that was compared with the error target last; 0: none yet
  double fraction_ = 0;          ///< reported so far
};

}  // namespace core
