/// Progress of a task: errors measured so far and work that remains.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "core/error/error_estimate.h"
#include "core/error/light_not_found.h"
#include "core/settings/settings.h"

namespace core {

struct ConvergencePoint {
  int samples_per_pixel = 0;
  double elapsed_seconds = 0;
  double cpu_seconds = 0;
  std::uint64_t rays = 0;
  ErrorInterval error;
};

/// Returns whether the error is that of the image, with its bias: the halves show it, or it was
/// measured by comparison.
bool error_is_valid(const ErrorInterval& error, const RenderSettings& settings);

struct Progress {
  double fraction = 0;  ///< below 1 until the end; never decreases while the stop rules stay the
                        ///< same
  int samples_min = 0;
  double samples_mean = 0;
  int samples_max = 0;
  double elapsed_seconds = 0;
  double cpu_seconds = 0;
  std::optional<double> eta_seconds;
  /// Interval of eta_seconds, assuming a constant pace.
  std::optional<double> eta_low_seconds;
  std::optional<double> eta_high_seconds;
  std::uint64_t rays = 0;
  double rays_per_second = 0;
  std::uint64_t rejected_samples = 0;
  ErrorInterval error;  ///< from the last estimate; NaN before the first
  std::uint32_t revision = 0;
  std::optional<LightNotFound> light_not_found;  ///< empty before the first census
  bool has_meter_readings = false;               ///< every point of the meter has a sample

  /// 1 / (relative error^2 * CPU seconds); NaN if unknown.
  double efficiency() const noexcept { return efficiency_at(error.relative); }
  /// Bounds of the efficiency at the confidence level of the error.
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
