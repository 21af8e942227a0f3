/// Estimates the remaining time of a job, with an interval. Pure functions.
#pragma once

#include <optional>
#include <span>

namespace core {

/// Remaining time in seconds; low <= expected <= high.
struct Remaining {
  double expected = 0;
  double low = 0;
  double high = 0;
};

/// Progress at one time: seconds of rendering and mean samples per pixel.
struct PacePoint {
  double elapsed_seconds = 0;
  double samples = 0;
};

/// Returns the seconds for `samples` more at the pace of the passes so far. The interval is two
/// standard errors, estimated from the variation between passes, and at least 5%. With fewer than
/// four passes it ranges from half to twice the time. Empty while the pace is unknown. points: in
/// order of time.
std::optional<Remaining> seconds_for(std::span<const PacePoint> points, double samples);

/// Returns the remaining time until the earlier of two ends: the smaller of each bound.
Remaining earlier(const Remaining& a, const Remaining& b);

/// Returns the samples at which an upper bound of the error meets a target. `bound` holds at
/// `samples` and falls as samples^-exponent.
double samples_for_error(double samples, double bound, double target, double exponent = 0.5);

/// A measured error.
struct SeenError {
  double samples = 0;
  double error = 0;
};

/// Returns the exponent of the convergence so far: least squares over the last 16-fold increase of
/// samples, clamped to [0.5, 1], where 0.5 holds for independent samples. Returns 0.5 for fewer
/// than four errors or less than a 4-fold increase. seen: in order of samples.
double error_exponent(std::span<const SeenError> seen);

}  // namespace core
