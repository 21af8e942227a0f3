/// Progress of a task: the errors measured so far, and the work that is left.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "core/error/error_estimate.h"

namespace core {

struct ConvergencePoint {
  int samples_per_pixel = 0;
  double elapsed_seconds = 0;
  double cpu_seconds = 0;
  std::uint64_t rays = 0;
  ErrorInterval error;
};

struct Progress {
  double fraction = 0;  ///< below 1 until the end; does not fall while the stop rules stay
  int samples_min = 0;
  double samples_mean = 0;
  int samples_max = 0;
  double elapsed_seconds = 0;
  double cpu_seconds = 0;
  std::optional<double> eta_seconds;
  /// Interval of eta_seconds, as long as the pace stays the same.
  std::optional<double> eta_low_seconds;
  std::optional<double> eta_high_seconds;
  std::uint64_t rays = 0;
  double rays_per_second = 0;
  std::uint64_t rejected_samples = 0;
  ErrorInterval error;  ///< of the last estimate; NaN before
  std::uint32_t revision = 0;

  /// 1 / (relative error^2 * CPU seconds); NaN when unknown.
  double efficiency() const noexcept { return efficiency_at(error.relative_rmse); }
  /// Ends of its interval, with the confidence of the error's.
  double efficiency_low() const noexcept { return efficiency_at(error.high); }
  double efficiency_high() const noexcept { return efficiency_at(error.low); }

 private:
  double efficiency_at(double relative_error) const noexcept {
    return relative_error > 0 && cpu_seconds > 0
               ? 1 / (relative_error * relative_error * cpu_seconds)
               : std::numeric_limits<double>::quiet_NaN();
  }
};

}  // namespace core
