/// How long a job still takes, with an interval. Pure functions.
#pragma once

#include <optional>
#include <span>

namespace core {

/// Seconds; low <= expected <= high.
struct Remaining {
  double expected = 0;
  double low = 0;
  double high = 0;
};

/// A moment of a job: seconds of rendering so far, mean samples of a pixel by then.
struct PacePoint {
  double elapsed_seconds = 0;
  double samples = 0;
};

/// Seconds for `samples` more, at the pace of the passes so far; the interval is two standard
/// errors of it, from how passes differ, at least 5 %. Fewer than four passes: half to twice. Empty
/// before there is a pace. points in order of time.
std::optional<Remaining> seconds_for(std::span<const PacePoint> points, double samples);

/// The first of two ends: of each bound the smaller one.
Remaining earlier(const Remaining& a, const Remaining& b);

/// Samples at which an upper bound of the error meets a target. bound: seen at `samples`; it falls
/// as samples^-exponent.
double samples_for_error(double samples, double bound, double target, double exponent = 0.5);

/// An error that was seen.
struct SeenError {
  double samples = 0;
  double error = 0;
};

/// The exponent by which errors fell so far, least squares over the last 16-fold of samples;
/// between that of independent samples, 0.5, and 1. With fewer than four errors or less than 4-fold
/// samples: 0.5. seen in order of samples.
double error_exponent(std::span<const SeenError> seen);

}  // namespace core
