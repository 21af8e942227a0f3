// How far a task is, and when it will be done.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/render/render_task_impl.h"

namespace core {

RenderTask::Impl::SamplesAtEnd RenderTask::Impl::samples_at_end() const {
  const double most = samples_max();
  SamplesAtEnd end = {most, most, most};
  const double e = error.relative_rmse;
  if (!stop.relative_error || !(e > 0) || points.empty()) {
    return end;
  }
  const double bound = stop_bound > 0 ? stop_bound : error.high;
  // Only looks end a job, and not the first ones; before one could have, nothing is promised of those before a full one.
  const int first = points.back().samples_per_pixel < kSamplesBeforeErrorStop ? kSamplesBeforeFullLook : kSamplesBeforeErrorStop;
  std::vector<SeenError> seen_errors;
  for (const ConvergencePoint& point : points) {
    seen_errors.push_back({static_cast<double>(point.samples_per_pixel), point.error.relative_rmse});
  }
  const double exponent = error_exponent(seen_errors);
  const auto look_for = [&](double seen, double falls) REQUIRES(mutex) {
    const double needed = samples_for_error(points.back().samples_per_pixel, seen, *stop.relative_error, falls);
    const double least = std::max({needed, static_cast<double>(base_samples) + 1, static_cast<double>(first)});
    return least >= most ? most : std::min<double>(look_after(static_cast<int>(std::ceil(least)) - 1), most);
  };
  end.expected = look_for(bound, exponent);
  end.low = look_for(bound * error.low / e, exponent);
  end.high = look_for(bound * error.high / e, 0.5);  // as if the rest were independent samples
  return end;
}

Progress RenderTask::progress() const {
  Impl& m = *impl_;
  Progress p;
  p.cpu_seconds = m.film->cpu_seconds();
  p.rays = m.film->rays();
  p.rejected_samples = m.film->rejected_samples();
  p.revision = m.film->revision();
  const SampleCounts counts = m.film->sample_counts();
  MutexLock lock(m.mutex);
  p.samples_min = static_cast<int>(counts.min);
  p.samples_max = static_cast<int>(counts.max);
  p.samples_mean = counts.mean;
  p.elapsed_seconds = m.elapsed_now();
  p.rays_per_second = p.elapsed_seconds > 0 ? static_cast<double>(p.rays) / p.elapsed_seconds : 0;
  p.error = m.error;
  const double e = p.error.relative_rmse;
  p.efficiency = e > 0 && p.cpu_seconds > 0 ? 1 / (e * e * p.cpu_seconds)
                                            : std::numeric_limits<double>::quiet_NaN();
  const double samples = m.samples_mean();
  const Impl::SamplesAtEnd end = m.samples_at_end();
  double share = samples / end.expected;
  std::optional<Remaining> left;
  // Before its first look a target may be met by any count.
  const bool unknown = m.stop.relative_error && !m.stop.samples_per_pixel && (m.points.empty() || !(e > 0));
  const auto rate = seconds_for(m.pace, 1.0);
  if (!unknown && rate) {
    left = Remaining{std::max(end.expected - samples, 0.0) * rate->expected, std::max(end.low - samples, 0.0) * rate->low,
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
  if (m.stop.seconds) {
    clock(*m.stop.seconds - p.elapsed_seconds, *m.stop.seconds);
  }
  if (m.stop.deadline_unix_seconds) {
    const double rest = *m.stop.deadline_unix_seconds - unix_seconds();
    clock(rest, p.elapsed_seconds + std::max(rest, 0.0));
  }
  // A look may find that more samples are needed than was thought: then it stands still, and the time left says so.
  m.fraction_told = std::max(m.fraction_told, std::clamp(share, 0.0, 0.999));
  p.fraction = m.over && m.reason != StopReason::kCancelled ? 1.0 : m.fraction_told;
  if (!m.over && left) {
    p.eta_seconds = left->expected;
    p.eta_low_seconds = left->low;
    p.eta_high_seconds = left->high;
  }
  return p;
}

}  // namespace core
