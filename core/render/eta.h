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

/// Seconds for `samples` more, at the pace of the passes so far; the interval is two standard errors of it, from how passes
/// differ, at least 5 %. Fewer than four passes: half to twice. Empty before there is a pace. points in order of time.
std::optional<Remaining> seconds_for(std::span<const PacePoint> points, double samples);

/// The first of two ends: of each bound the smaller one.
Remaining earlier(const Remaining& a, const Remaining& b);

/// Samples at which an upper bound of the error meets a target: variance falls as 1/N. bound: seen at `samples`.
double samples_for_error(double samples, double bound, double target);

}  // namespace core
