#include "core/render/task/progress_meter.h"

#include <algorithm>
#include <chrono>
#include <optional>

#include "core/integrators/registry.h"

namespace core {
namespace {

/// Number of passes from which the pace is estimated.
constexpr std::size_t kPacePoints = 32;

double unix_seconds() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace

bool error_is_valid(const ErrorInterval& error, const RenderSettings& settings) {
  return halves_show_error(settings) || error.form == ErrorForm::kSquares;
}

ErrorInterval ProgressMeter::error() const {
  return points_.empty() ? unknown_error() : points_.back().error;
}

void ProgressMeter::note_pass(int samples, double elapsed_seconds) {
  if (!pace_.empty() && pace_.back().samples >= samples) {
    return;
  }
  if (pace_.size() >= kPacePoints) {
    pace_.erase(pace_.begin());
  }
  pace_.push_back({elapsed_seconds, static_cast<double>(samples)});
}

void ProgressMeter::note_check(const ConvergencePoint& point, double bound) {
  points_.push_back(point);
  bound_ = bound;
}

/// Returns the samples at which the rules about samples and errors end the job.
Remaining ProgressMeter::samples_at_end(const PassPolicy& policy, int base) const {
  const double most = policy.samples_max();
  const ErrorInterval seen = error();
  const double e = seen.relative;
  if (!policy.stop().relative_error || !(e > 0)) {
    return {most, most, most};
  }
  const double bound = bound_ > 0 ? bound_ : seen.high;
  std::vector<SeenError> errors;
  for (const ConvergencePoint& point : points_) {
    errors.push_back({static_cast<double>(point.samples_per_pixel), point.error.relative});
  }
  const double exponent = error_exponent(errors);
  const auto end = [&](double from, double falls) -> double {
    const double needed = samples_for_error(points_.back().samples_per_pixel, from,
                                            *policy.stop().relative_error, falls);
    return policy.stop_at(std::max(needed, static_cast<double>(base) + 1));
  };
  // In the worst case the remaining error falls as with independent samples.
  return {end(bound, exponent), end(bound * seen.low / e, exponent),
          end(bound * seen.high / e, 0.5)};
}

void ProgressMeter::tell(const PassPolicy& policy, double samples, int base, bool is_over,
                         Progress& p) {
  const StopRules& stop = policy.stop();
  p.error = error();
  const double e = p.error.relative;
  const Remaining end = samples_at_end(policy, base);
  double share = samples / end.expected;
  std::optional<Remaining> left;
  // Before the first estimate any count may meet a target; the convergence of the other errors is
  // unknown.
  const bool has_target = stop.denoised_error || stop.meter_error || stop.light_not_found ||
                          (stop.relative_error && !(e > 0));
  const bool unknown = has_target && !stop.samples_per_pixel;
  const auto rate = seconds_for(pace_, 1.0);
  if (!unknown && rate) {
    left = Remaining{std::max(end.expected - samples, 0.0) * rate->expected,
                     std::max(end.low - samples, 0.0) * rate->low,
                     std::max(end.high - samples, 0.0) * rate->high};
  } else if (!unknown && share > 0 && p.elapsed_seconds > 0.05) {
    const double seconds = p.elapsed_seconds * (1 - std::min(share, 1.0)) / share;
    left = Remaining{seconds, seconds / 2, seconds * 2};
  }
  const auto clock = [&](double seconds, double length) {
    const double rest = std::max(seconds, 0.0);
    share = std::max(share, 1 - rest / std::max(length, 1e-9));
    left = left ? earlier(*left, {rest, rest, rest}) : Remaining{rest, 0, rest};
  };
  if (stop.seconds) {
    clock(*stop.seconds - p.elapsed_seconds, *stop.seconds);
  }
  if (stop.cpu_seconds && p.cpu_seconds > 0) {
    const double pace = p.elapsed_seconds / p.cpu_seconds;
    clock((*stop.cpu_seconds - p.cpu_seconds) * pace, *stop.cpu_seconds * pace);
  }
  if (stop.deadline_unix_seconds) {
    const double rest = *stop.deadline_unix_seconds - unix_seconds();
    clock(rest, p.elapsed_seconds + std::max(rest, 0.0));
  }
  // If an estimate requires more samples than expected, the fraction stays and the remaining time
  // grows.
  fraction_ = std::max(fraction_, std::clamp(share, 0.0, 0.999));
  p.fraction = fraction_;
  if (!is_over && left) {
    p.eta_seconds = left->expected;
    p.eta_low_seconds = left->low;
    p.eta_high_seconds = left->high;
  }
}

}  // namespace core
