// What a RenderTask knows of its picture when it looks at it: light edges, error estimates, points of convergence.
#include <algorithm>
#include <bit>
#include <chrono>
#include <optional>
#include <vector>

#include "core/render/render_task_impl.h"

namespace core {
namespace {

/// Samples of all probes of a look: so many, or that share of the picture's; and of one, those of the other pixels times this.
constexpr double kProbes = 131072;
constexpr double kProbeShare = 0.02;
constexpr int kProbeMost = 1024;

}  // namespace

ErrorEstimate RenderTask::Impl::estimate_of(const FilmSnapshot& snapshot, int samples) {
  {
    // Other jobs do not take the time; what is said of them is what their films alone tell, wherever they are merged.
    MutexLock lock(mutex);
    if (!stop.relative_error || samples < kSamplesBeforeErrorStop) {
      return ErrorEstimate(snapshot);
    }
  }
  const LightEdges& at_edges = light_edges(EdgeDetail::kErrors);
  ErrorEstimate estimate(snapshot, at_edges);
  const std::vector<std::uint32_t>& doubtful = estimate.doubtful();
  if (doubtful.empty()) {
    return estimate;
  }
  const double all = std::max(kProbes, kProbeShare * static_cast<double>(snapshot.pixel_count()) * samples);
  const double each = std::min(all / static_cast<double>(doubtful.size()), static_cast<double>(kProbeMost) * samples);
  // A power of two: each half is then a whole net of a low-discrepancy sequence.
  const auto each_whole = static_cast<int>(std::bit_floor(static_cast<unsigned>(each)));
  const double cpu_start = thread_cpu_seconds();
  const std::vector<ProbedPixel> probed = estimate.surprises(renderer->probe(doubtful, each_whole, cancel_source.get_token()));
  film->add_cpu_seconds(thread_cpu_seconds() - cpu_start);
  return probed.empty() ? estimate : ErrorEstimate(snapshot, at_edges, probed);
}

/// For about so long, or until it is known.
void RenderTask::Impl::search_edges(EdgeDetail detail, double seconds, const std::stop_token& stopped) {
  const double cpu_start = thread_cpu_seconds();
  const TaskClock::time_point start = TaskClock::now();
  bool known = false;
  {
    MutexLock lock(edges_mutex);
    if (!edge_search) {
      edge_search = renderer->light_edge_search();
    }
    known = edge_search->knows(detail);
    while (!known && !stopped.stop_requested() && std::chrono::duration<double>(TaskClock::now() - start).count() < seconds) {
      edge_search->step(detail);
      known = edge_search->knows(detail);
    }
  }
  film->add_cpu_seconds(thread_cpu_seconds() - cpu_start);
  MutexLock lock(mutex);
  if (known && edges_known < detail) {
    edges_known = detail;
  }
}

/// None when the job was cancelled meanwhile.
const LightEdges& RenderTask::Impl::light_edges(EdgeDetail detail) {
  static const LightEdges kNone;
  const std::stop_token cancelled_now = cancel_source.get_token();
  while (!cancelled_now.stop_requested()) {
    {
      MutexLock lock(edges_mutex);
      if (edge_search && edge_search->knows(detail)) {
        return edge_search->edges(detail);  // they stay as they are
      }
    }
    search_edges(detail, 1, cancelled_now);
  }
  return kNone;
}

ConvergencePoint RenderTask::Impl::look(const ErrorEstimate& estimate, int samples) const {
  ConvergencePoint point;
  point.samples_per_pixel = samples;
  point.cpu_seconds = film->cpu_seconds();
  point.rays = film->rays();
  MutexLock lock(mutex);
  point.elapsed_seconds = elapsed_now();
  point.error = estimate.image(stop.confidence);
  return point;
}

}  // namespace core
