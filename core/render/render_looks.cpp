// What a RenderTask knows of its picture when it looks at it: light edges, error estimates, points of convergence.
#include <algorithm>
#include <bit>
#include <chrono>
#include <optional>
#include <vector>

#include "core/render/render_task_impl.h"

namespace core {
namespace {

/// Samples of all probes of a look: so many, or that share of the picture's if it is more; and of one, those of the other pixels times this.
constexpr double kProbes = 131072;
constexpr double kProbeShare = 0.02;
constexpr int kProbeMost = 1024;
/// Places along the side of a pixel from which on the variance at a rim is known to some percent.
constexpr int kCloseSide = 8;
/// Before every look is a full one, of a film that says at least more than this times the target nothing more is asked.
constexpr double kNear = 1.25;

}  // namespace

/// missing: gets the probes that it takes and that nobody has made; then what is returned lacks them. nullptr: nobody waits for any.
ErrorEstimate RenderTask::Impl::estimate_of(const FilmSnapshot& snapshot, int samples, bool is_last, std::vector<Probe>* missing) {
  std::optional<double> target;
  std::optional<EdgeDetail> at_hand;
  {
    MutexLock lock(mutex);
    target = stop.relative_error;
    at_hand = edges_known;
  }
  if (!target) {
    // Nobody waits for what is said on the way, and few samples are not worth the search.
    if (!at_hand && (!is_last || samples < kSamplesBeforeEdges)) {
      return ErrorEstimate(snapshot);
    }
    const EdgeDetail detail = at_hand.value_or(EdgeDetail::kPlans);
    const LightEdges& edges = light_edges(detail);
    // Of rims so many that their luck is averaged out a film knows as much.
    if (!edges.empty() && is_close(detail)) {
      return ErrorEstimate(snapshot, edges, {}, true);
    }
    return ErrorEstimate(snapshot);
  }
  if (samples < kSamplesBeforeErrorStop) {
    return ErrorEstimate(snapshot);
  }
  const auto may_end = [&](const ErrorEstimate& estimate) {
    return samples >= kSamplesBeforeFullLook || estimate.least() <= kNear * *target;
  };
  if (samples < kSamplesBeforeFullLook) {
    ErrorEstimate of_film(snapshot);
    if (!may_end(of_film)) {
      return of_film;
    }
  }
  const LightEdges& edges = light_edges(EdgeDetail::kErrors);
  ErrorEstimate estimate(snapshot, edges);
  const std::vector<std::uint32_t>& doubtful = estimate.doubtful();
  if (doubtful.empty() || !may_end(estimate)) {
    return estimate;
  }
  const double all = std::max(kProbes, kProbeShare * static_cast<double>(snapshot.pixel_count()) * samples);
  const double each = std::min(all / static_cast<double>(doubtful.size()), static_cast<double>(kProbeMost) * samples);
  // A power of two: each half is then a whole net of a low-discrepancy sequence.
  const auto each_whole = static_cast<int>(std::bit_floor(static_cast<unsigned>(each)));
  std::vector<Probe> wanted;
  for (const std::uint32_t pixel : doubtful) {
    wanted.push_back({pixel, each_whole});
  }
  const std::vector<ProbedPixel> surprising = estimate.surprises(probes_of(wanted, missing));
  if (surprising.empty()) {
    return estimate;
  }
  return ErrorEstimate(snapshot, edges, surprising);
}

/// Those that were made; the others are added to `missing`, if it is not nullptr.
std::vector<ProbedPixel> RenderTask::Impl::probes_of(std::span<const Probe> wanted, std::vector<Probe>* missing) {
  std::vector<ProbedPixel> out;
  MutexLock lock(mutex);
  for (const Probe& probe : wanted) {
    const auto made = probed.find(probe);
    if (made != probed.end()) {
      out.push_back(made->second);
    } else if (missing != nullptr) {
      missing->push_back(probe);
    }
  }
  return out;
}

/// The next of probes_due. None is made when the task is stopped meanwhile.
void RenderTask::Impl::run_probe() {
  Probe probe;
  {
    MutexLock lock(mutex);
    probe = probes_due[probes_begun++];
  }
  const double cpu_start = thread_cpu_seconds();
  const std::vector<ProbedPixel> made = renderer->probe({&probe.pixel, 1}, probe.samples, stop_source.get_token());
  film->add_cpu_seconds(thread_cpu_seconds() - cpu_start);
  MutexLock lock(mutex);
  if (!made.empty()) {
    probed.insert({probe, made.front()});
  }
  --in_flight;
  note_clock();
}

/// For about so long, or until it is known.
void RenderTask::Impl::search_edges(EdgeDetail detail, double seconds, const std::stop_token& stopped) {
  const double cpu_start = thread_cpu_seconds();
  const TaskClock::time_point start = TaskClock::now();
  bool known = false;
  bool sparing = false;
  {
    MutexLock lock(mutex);
    sparing = !stop.relative_error && !film->has_pilot();
  }
  {
    MutexLock lock(edges_mutex);
    if (!edge_search) {
      edge_search = renderer->light_edge_search();
      if (sparing) {
        edge_search->be_sparing();
      }
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

/// Did the search look at each rim closely? Not when it was cancelled.
bool RenderTask::Impl::is_close(EdgeDetail detail) {
  MutexLock lock(edges_mutex);
  return edge_search && edge_search->knows(detail) && edge_search->side(detail) >= kCloseSide;
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
