/// RenderTask::Impl: the phases of a task, for render_task.cpp alone.
#pragma once

#include <algorithm>
#include <chrono>
#include <limits>
#include <map>

#include "core/base/mutex.h"
#include "core/render/pass_plan.h"
#include "core/render/pass_policy.h"
#include "core/render/progress_meter.h"
#include "core/render/render_task.h"

namespace core {

using Clock = std::chrono::steady_clock;

/// Seconds of rendering, without pauses.
struct Stopwatch {
  double before = 0;
  std::optional<Clock::time_point> since;

  double seconds() const {
    return before + (since ? std::chrono::duration<double>(Clock::now() - *since).count() : 0.0);
  }
  void start() { since = since ? since : Clock::now(); }
  void stop() {
    before = seconds();
    since.reset();
  }
};

/// CPU time that a sample of all pixels takes, from what some took.
inline double seconds_of_sample(double pixels, int samples, double cpu_seconds) {
  constexpr double kFirstGuess =
      1.5e-6;  // seconds a sample; only the first slice of a tile uses it
  return std::max(samples > 0 ? cpu_seconds / samples : pixels * kFirstGuess, 1e-9);
}

/// Samples that a slice is to have for so many seconds. pixels: of each sample; samples,
/// cpu_seconds: so far.
inline int slice_length(double pixels, int samples, double cpu_seconds, double seconds) {
  const double each = seconds_of_sample(pixels, samples, cpu_seconds);
  // Samples of a pixel are far fewer.
  return std::max(1, static_cast<int>(std::min(seconds / each, 1e6)));
}

/// Phases: rendering passes, piloting before an epoch, a prepass before a pass, deciding (one
/// thread does, and no slice is out), over. Every function takes the lock once at most; what is
/// REQUIRES(mutex) never calls out.
struct RenderTask::Impl {
  enum class Phase { kRendering, kPiloting, kPrepass, kDeciding, kOver };
  /// What the deciding thread does next.
  enum class Step { kNone, kPass, kPlan, kPrepass, kBuild, kEnd };
  struct Due {
    Step step = Step::kNone;
    int samples = 0;
    bool looks = false;    ///< at the error
    bool is_news = false;  ///< no point has as many samples
    StopReason why = StopReason::kNone;
    std::map<int, TileState> taken_back = {};  ///< tiles as they were at the last complete pass
  };
  /// At the error of a complete pass.
  struct Look {
    ConvergencePoint point;
    double bound = std::numeric_limits<double>::infinity();  ///< PassPolicy::error_bound()
    double denoised_bound = std::numeric_limits<double>::infinity();
  };
  struct Tile {
    int samples = 0;  ///< both of camera and light paths, where it has both
    int pilot_samples = 0;
    bool is_out = false;  ///< a slice of it is
  };

  /// Those of sample pass.base, where samples need any.
  struct PrepassWork {
    std::shared_ptr<Prepass> pass;
    int parts_out = 0;  ///< handed out
    int parts_done = 0;
    std::uint64_t rays = 0;
    double cpu_seconds = 0;
  };

  const std::shared_ptr<const Renderer> renderer;
  const std::shared_ptr<Film> film;
  const int samples_limit;
  const double slice_seconds;
  const std::function<double(const Film&, double)> denoised_bound;
  RenderSink& sink;
  std::stop_source stop_source;  // of slices: cancelled, or a clock ran out

  mutable Mutex mutex;
  Phase phase GUARDED_BY(mutex) = Phase::kRendering;
  StopReason ending GUARDED_BY(mutex) = StopReason::kNone;  // no slice is handed out any more
  bool paused GUARDED_BY(mutex) = false;
  int in_flight GUARDED_BY(mutex) = 0;
  PassPolicy policy GUARDED_BY(mutex);
  Pass pass GUARDED_BY(mutex);
  std::vector<Tile> tiles GUARDED_BY(mutex);
  std::size_t cursor GUARDED_BY(mutex) = 0;  // the tile that is asked first
  PrepassWork prepass GUARDED_BY(mutex);
  std::map<int, TileState> pass_base GUARDED_BY(mutex);  // tiles before this pass; clock rules only
  Stopwatch clock GUARDED_BY(mutex);
  ProgressMeter meter GUARDED_BY(mutex);

  Impl(std::shared_ptr<const Renderer> r, std::shared_ptr<Film> f, TaskOptions o, RenderSink& s);

  const RenderSettings& settings() const { return renderer->view().settings; }
  std::optional<Slice> find_slice(Place place) REQUIRES(mutex);
  std::optional<Slice> find_slice_of(SliceKind kind) REQUIRES(mutex);
  bool needs_prepass() const REQUIRES(mutex);
  int pilot_target() const REQUIRES(mutex) {
    return film->has_pilot() ? pilot_samples_at(pass.planned_to) : 0;
  }
  bool all_have(int Tile::*samples, int count) const REQUIRES(mutex);
  void note_clock() REQUIRES(mutex);
  Due next_due() REQUIRES(mutex);
  Due due_end() REQUIRES(mutex);
  Due complete(const Slice& slice, int last, std::optional<TileState> before) EXCLUDES(mutex);

  LightBatch light_of(int unit, int last_sample) const;
  void run_part(const Slice& slice) EXCLUDES(mutex);
  bool gather(TileState& state, std::stop_token stop) EXCLUDES(mutex);
  Due begin_prepass(int sample) EXCLUDES(mutex);
  Due build_prepass() EXCLUDES(mutex);
  void advance(Due due) EXCLUDES(mutex);
  void settle_splats() EXCLUDES(mutex);
  Due decide(const Due& due) EXCLUDES(mutex);
  Due begin_epoch(int from) EXCLUDES(mutex);
  Look look(const Due& due, const PassPolicy& by) EXCLUDES(mutex);
  Due settle(int samples, StopReason why) EXCLUDES(mutex);
  void end(Due due) EXCLUDES(mutex);
  PassPolicy policy_now() const EXCLUDES(mutex);
  void note(Look& seen) EXCLUDES(mutex);
  void finish(StopReason why) EXCLUDES(mutex);
};

}  // namespace core
