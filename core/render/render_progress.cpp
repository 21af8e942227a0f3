// How far a task is, and when it will be done.
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/render/render_task_impl.h"

namespace core {

Progress RenderTask::progress() const {
  const Impl& m = *impl_;
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
  double share = p.samples_mean / m.samples_max();
  if (m.stop.relative_error && e > 0 && !m.points.empty()) {
    // The variance falls as 1/N.
    const double needed = m.points.back().samples_per_pixel * (e / *m.stop.relative_error) * (e / *m.stop.relative_error);
    share = std::max(share, p.samples_mean / std::max(needed, 1.0));
  }
  if (m.stop.seconds) {
    share = std::max(share, p.elapsed_seconds / *m.stop.seconds);
  }
  if (m.stop.deadline_unix_seconds) {
    const double left = *m.stop.deadline_unix_seconds - unix_seconds();
    share = std::max(share, p.elapsed_seconds / std::max(p.elapsed_seconds + left, 1e-9));
  }
  p.fraction = m.over && m.reason != StopReason::kCancelled ? 1.0 : std::clamp(share, 0.0, 0.999);
  if (!m.over && share > 0 && p.elapsed_seconds > 0.05) {
    p.eta_seconds = p.elapsed_seconds * (1 - p.fraction) / std::max(p.fraction, 1e-9);
  }
  return p;
}

}  // namespace core
