/// What a RenderTask is inside; for render_task.cpp, render_looks.cpp and render_progress.cpp alone.
#pragma once

#include <algorithm>
#include <chrono>
#include <compare>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/base/cpu_time.h"
#include "core/render/pass_plan.h"
#include "core/render/registry.h"
#include "core/render/render_task.h"

namespace core {

using TaskClock = std::chrono::steady_clock;

inline double unix_seconds() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

inline ErrorInterval unknown_error() {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  return {nan, nan, nan, false};
}

/// No error target ends a job before: halves of single samples tell nothing of it.
constexpr int kSamplesBeforeErrorStop = 4;
/// From here on every look of an error target uses what the scene knows and probes; before, only those that may well end the job.
constexpr int kSamplesBeforeFullLook = 32;
/// Jobs of fewer samples, such as previews, do not ask the scene.
constexpr int kSamplesBeforeEdges = 16;

/// A pixel, row by row over the film's crop, and how many samples it is to be probed by.
struct Probe {
  std::uint32_t pixel = 0;
  int samples = 0;
  auto operator<=>(const Probe&) const = default;
};

struct RenderTask::Impl {
  std::shared_ptr<const Renderer> renderer;
  std::shared_ptr<Film> film;
  TaskOptions options;
  RenderSink& sink;
  std::stop_source stop_source;    // of what is being traced: cancelled, or a clock ran out
  std::stop_source cancel_source;

  Mutex edges_mutex;
  std::unique_ptr<LightEdgeSearch> edge_search GUARDED_BY(edges_mutex);

  mutable Mutex mutex;
  StopRules stop GUARDED_BY(mutex);
  std::vector<int> done GUARDED_BY(mutex);             // samples a tile has
  std::vector<char> busy GUARDED_BY(mutex);            // a slice of the tile is out
  std::map<int, TileState> pass_base GUARDED_BY(mutex);  // tiles before this pass; clock rules only
  std::vector<ConvergencePoint> points GUARDED_BY(mutex);
  ErrorInterval error GUARDED_BY(mutex) = unknown_error();
  std::size_t cursor GUARDED_BY(mutex) = 0;
  int pass_target GUARDED_BY(mutex) = 0;
  std::optional<EdgeDetail> edges_known GUARDED_BY(mutex);
  bool edges_out GUARDED_BY(mutex) = false;   // a slice of the search is
  bool edges_last GUARDED_BY(mutex) = false;  // the slice handed out last was one: the next is of the picture
  std::vector<Probe> probes_due GUARDED_BY(mutex);  // what a decision waits for
  std::size_t probes_out GUARDED_BY(mutex) = 0;     // of these, handed out
  std::size_t probes_begun GUARDED_BY(mutex) = 0;
  std::map<Probe, ProbedPixel> probed GUARDED_BY(mutex);  // they are the same at every look
  std::vector<int> piloted GUARDED_BY(mutex);  // pilot samples a tile has
  int planned_to GUARDED_BY(mutex) = std::numeric_limits<int>::max();  // beyond, the plan of the next epoch is needed
  int decided_at GUARDED_BY(mutex) = -1;   // the complete pass whose decisions are taken
  int base_samples GUARDED_BY(mutex) = 0;  // what every tile had at the last complete pass
  // Can every tile be put back to base_samples? Not in the pass that a restart or a late clock rule met half done:
  // that one is completed first.
  bool base_is_whole GUARDED_BY(mutex) = false;
  int in_flight GUARDED_BY(mutex) = 0;
  int last_reported GUARDED_BY(mutex) = -1;
  std::vector<PacePoint> pace GUARDED_BY(mutex);  // of the last passes of this run
  double fraction_told GUARDED_BY(mutex) = 0;  // does not fall while the rules stay
  double stop_bound GUARDED_BY(mutex) = 0;  // what the error rule compared with its target last; 0: nothing yet
  double look_cost GUARDED_BY(mutex) = 0;    // CPU seconds that the last report took
  double look_ended GUARDED_BY(mutex) = -1e9;  // those of the picture then
  bool reporting GUARDED_BY(mutex) = false;    // a report is being computed beside the rendering
  bool deciding GUARDED_BY(mutex) = false;
  bool paused GUARDED_BY(mutex) = false;
  bool cancelled GUARDED_BY(mutex) = false;
  bool expired GUARDED_BY(mutex) = false;
  StopReason expired_reason GUARDED_BY(mutex) = StopReason::kNone;
  StopReason reason GUARDED_BY(mutex) = StopReason::kNone;
  bool over GUARDED_BY(mutex) = false;
  double elapsed GUARDED_BY(mutex) = 0;
  std::optional<TaskClock::time_point> running_since GUARDED_BY(mutex);

  Impl(std::shared_ptr<const Renderer> r, std::shared_ptr<Film> f, TaskOptions o, RenderSink& s)
      : renderer(std::move(r)), film(std::move(f)), options(std::move(o)), sink(s) {
    MutexLock lock(mutex);
    stop = options.stop;
    elapsed = options.elapsed_before;
    points = options.points_before;
    if (!points.empty()) {
      error = points.back().error;
      last_reported = points.back().samples_per_pixel;
    }
    const auto n = static_cast<std::size_t>(film->tile_count());
    busy.assign(n, 0);
    for (int t = 0; t < film->tile_count(); ++t) {
      done.push_back(film->tile_samples(t));
      pass_target = std::max(pass_target, done.back());
      piloted.push_back(film->has_pilot() ? film->tile(t).pilot_samples : 0);
    }
    const RenderSettings& settings = renderer->view().settings;
    if (film->has_plan()) {  // a film without room for plans is uniform, whatever the job says
      const PlanSpan span = film->tile(0).span;  // the same for all tiles
      planned_to = span.to > 0 ? span.to : first_epoch(settings);
    }
    base_samples = *std::min_element(done.begin(), done.end());
    base_is_whole = base_samples == pass_target;
  }

  bool has_clock() const REQUIRES(mutex) { return stop.seconds || stop.deadline_unix_seconds; }

  double elapsed_now() const REQUIRES(mutex) {
    return elapsed + (running_since
                          ? std::chrono::duration<double>(TaskClock::now() - *running_since).count()
                          : 0.0);
  }

  int unit() const { return sample_unit(renderer->view().settings); }

  int samples_max() const REQUIRES(mutex) {
    int most = whole_sets(options.samples_limit, unit());
    if (stop.samples_per_pixel) {
      most = std::min(most, rounded_samples(renderer->view().settings, *stop.samples_per_pixel));
    }
    return std::max(most, 1);
  }

  /// No tile goes beyond this before everything else is there too.
  int barrier() const REQUIRES(mutex) {
    const int replicates = renderer->view().settings.replicates;
    if (has_clock()) {  // one pass at a time, so that the last complete one can be kept
      return base_samples < pass_target
                 ? pass_target
                 : std::max(std::min(pass_end(pass_target, samples_max(), replicates, unit()), planned_to), pass_target);
    }
    return std::max(std::min({look_after(base_samples), samples_max(), planned_to}), pass_target);
  }

  /// The first count above `samples` at which the task looks at its error, if that ends it; where tiles wait for each other otherwise.
  int look_after(int samples) const REQUIRES(mutex) {
    const RenderSettings& settings = renderer->view().settings;
    const bool is_planned = stop.relative_error && film->has_plan();
    return next_look(samples, settings.replicates, unit(), is_planned ? first_epoch(settings) : 0);
  }

  bool is_probing() const REQUIRES(mutex) { return !probes_due.empty(); }

  /// An epoch begins here, and its plan is not made yet.
  bool plan_is_due() const REQUIRES(mutex) { return decided_at == planned_to && pass_target == planned_to; }

  int pilot_target() const REQUIRES(mutex) { return film->has_pilot() ? pilot_samples_at(planned_to) : 0; }

  std::optional<Slice> find_pilot_slice() REQUIRES(mutex) {
    for (std::size_t t = 0; t < done.size(); ++t) {
      if (busy[t] == 0 && piloted[t] < pilot_target()) {
        return Slice{static_cast<int>(t), piloted[t], pilot_target(), SliceKind::kPilot};
      }
    }
    return std::nullopt;
  }

  bool pilot_complete() const REQUIRES(mutex) {
    return std::all_of(piloted.begin(), piloted.end(), [this](int n) REQUIRES(mutex) { return n >= pilot_target(); });
  }

  bool pass_complete() const REQUIRES(mutex) {
    return in_flight == 0 &&
           std::all_of(done.begin(), done.end(), [this](int n) REQUIRES(mutex) { return n >= pass_target; });
  }

  void note_clock() REQUIRES(mutex) {
    if (expired || base_samples < 1 || !base_is_whole || !has_clock()) {
      return;
    }
    if (stop.seconds && elapsed_now() >= *stop.seconds) {
      expired = true;
      expired_reason = StopReason::kSeconds;
    } else if (stop.deadline_unix_seconds && unix_seconds() >= *stop.deadline_unix_seconds) {
      expired = true;
      expired_reason = StopReason::kDeadline;
    }
    if (expired) {
      stop_source.request_stop();
    }
  }

  std::optional<Slice> find_slice() REQUIRES(mutex) {
    const std::size_t n = done.size();
    for (std::size_t step = 0; step < n; ++step) {
      const std::size_t t = (cursor + step) % n;
      if (busy[t] == 0 && done[t] < pass_target) {
        cursor = (t + 1) % n;
        return Slice{static_cast<int>(t), done[t], pass_target};
      }
    }
    return std::nullopt;
  }

  /// Should the search for light edges go on beside the picture? Not before there is one to see, and not where nothing will need it.
  bool edges_are_due() const REQUIRES(mutex) {
    return !edges_out && !edges_last && base_samples >= 2 && edges_wanted() > edges_known;
  }

  /// What will be asked for next.
  std::optional<EdgeDetail> edges_wanted() const REQUIRES(mutex) {
    if (!edges_known && film->has_pilot() && samples_max() > planned_to) {
      return EdgeDetail::kPlans;
    }
    if (stop.relative_error) {
      return samples_max() >= kSamplesBeforeFullLook ? std::optional(EdgeDetail::kErrors) : std::nullopt;
    }
    return samples_max() >= kSamplesBeforeEdges ? std::optional(EdgeDetail::kPlans) : std::nullopt;
  }

  /// Mean over the film's pixels, as far as tiles are.
  double samples_mean() const REQUIRES(mutex) {
    double area = 0;
    double sum = 0;
    for (std::size_t t = 0; t < done.size(); ++t) {
      const PixelRect r = film->tile_rect(static_cast<int>(t));
      area += static_cast<double>(r.width) * r.height;
      sum += static_cast<double>(r.width) * r.height * done[t];
    }
    return sum / area;
  }

  /// Samples at which the rules about samples and errors end the job.
  struct SamplesAtEnd {
    double expected = 0;
    double low = 0;
    double high = 0;
  };
  SamplesAtEnd samples_at_end() const REQUIRES(mutex);

  void search_edges(EdgeDetail detail, double seconds, const std::stop_token& stopped) EXCLUDES(mutex, edges_mutex);
  const LightEdges& light_edges(EdgeDetail detail) EXCLUDES(mutex, edges_mutex);
  ErrorEstimate estimate_of(const FilmSnapshot& snapshot, int samples, bool is_last, std::vector<Probe>* missing) EXCLUDES(mutex, edges_mutex);
  std::vector<ProbedPixel> probes_of(std::span<const Probe> wanted, std::vector<Probe>* missing) EXCLUDES(mutex);
  void run_probe() EXCLUDES(mutex);
  bool is_close(EdgeDetail detail) EXCLUDES(edges_mutex);
  void after_slice() EXCLUDES(mutex);
  void decide() EXCLUDES(mutex);
  void begin_epoch() EXCLUDES(mutex);
  void go_on() EXCLUDES(mutex);
  void finish(StopReason why) EXCLUDES(mutex);
  ConvergencePoint look(const ErrorEstimate& estimate, int samples) const EXCLUDES(mutex);
};

}  // namespace core
