/// RenderTask::Impl: the phases of a task; used by render_task.cpp only.
#pragma once

#include <algorithm>
#include <chrono>
#include <limits>
#include <map>

#include "core/base/mutex.h"
#include "core/render/task/pass_plan.h"
#include "core/render/task/pass_policy.h"
#include "core/render/task/progress_meter.h"
#include "core/render/task/reference_images.h"
#include "core/render/task/render_task.h"

namespace core {

using Clock = std::chrono::steady_clock;

/// Measures seconds of rendering, without pauses.
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

/// Returns the CPU time of one sample of all pixels, extrapolated from `samples`.
inline double seconds_of_sample(double pixels, int samples, double cpu_seconds) {
  constexpr double kFirstGuess =
      1.5e-6;  // seconds per sample; used only for the first slice of a tile
  return std::max(samples > 0 ? cpu_seconds / samples : pixels * kFirstGuess, 1e-9);
}

/// Returns the number of samples of a slice of `seconds`. pixels: per sample. samples, cpu_seconds:
/// so far.
inline int slice_length(double pixels, int samples, double cpu_seconds, double seconds) {
  const double each = seconds_of_sample(pixels, samples, cpu_seconds);
  // Pixels have far fewer samples than this.
  return std::max(1, static_cast<int>(std::min(seconds / each, 1e6)));
}

/// Phases: rendering passes, pilot samples before an epoch, a prepass before a pass, reference
/// images before a check of the error, deciding (on one thread, while no slice is out), over. Every
/// function locks at most once; functions with REQUIRES(mutex) make no callbacks.
struct RenderTask::Impl {
  enum class Phase { kRendering, kPiloting, kPrepass, kComparing, kDeciding, kOver };
  /// The next action of the deciding thread.
  enum class Step { kNone, kPass, kPlan, kPrepass, kBuild, kCompare, kEnd };
  struct Due {
    Step step = Step::kNone;
    int samples = 0;
    bool checks_error = false;
    bool is_news = false;  ///< no earlier point has this many samples
    StopReason why = StopReason::kNone;
    std::map<int, TileState> taken_back = {};  ///< tiles as of the last complete pass
  };
  /// The error estimate after a complete pass.
  struct ErrorCheck {
    ConvergencePoint point;
    double bound = std::numeric_limits<double>::infinity();  ///< PassPolicy::error_bound()
    double denoised_bound = std::numeric_limits<double>::infinity();
    std::optional<LightNotFound> light_not_found = {};
  };
  struct Tile {
    int samples = 0;  ///< the minimum of camera and light paths, if there are both
    int pilot_samples = 0;
    bool is_out = false;  ///< one of its slices is handed out
  };

  /// The prepass of sample pass.base, if samples need one.
  struct PrepassWork {
    std::shared_ptr<Prepass> pass;
    int parts_out = 0;  ///< number of parts handed out
    int parts_done = 0;
    std::uint64_t rays = 0;
    double cpu_seconds = 0;
  };

  /// The census of particles; parts are handed out in order.
  struct CensusWork {
    std::shared_ptr<LightCensus> census;  ///< null: not yet made
    bool is_wanted = false;
    bool is_being_made = false;
    int parts_out = 0;
  };

  const std::shared_ptr<const Renderer> renderer;
  const std::shared_ptr<Film> film;
  const int samples_limit;
  const double slice_seconds;
  const std::function<double(const Film&, double confidence)> denoised_bound;
  const std::unique_ptr<ReferenceImages> references;  // null: the halves show the error
  RenderSink& sink;
  std::stop_source stop_source;  // stops slices on cancellation or when a time limit is reached

  mutable Mutex mutex;
  Phase phase GUARDED_BY(mutex) = Phase::kRendering;
  StopReason ending GUARDED_BY(mutex) = StopReason::kNone;  // if set, no more slices are handed out
  bool paused GUARDED_BY(mutex) = false;
  int in_flight GUARDED_BY(mutex) = 0;
  PassPolicy policy GUARDED_BY(mutex);
  Pass pass GUARDED_BY(mutex);
  std::vector<Tile> tiles GUARDED_BY(mutex);
  std::size_t cursor GUARDED_BY(mutex) = 0;  // index of the tile to try first
  PrepassWork prepass GUARDED_BY(mutex);
  CensusWork census GUARDED_BY(mutex);
  std::optional<LightNotFound> light_not_found GUARDED_BY(mutex);
  std::map<int, TileState> pass_base GUARDED_BY(mutex);  // tiles before this pass; clock rules only
  Stopwatch clock GUARDED_BY(mutex);
  ProgressMeter meter GUARDED_BY(mutex);

  Impl(std::shared_ptr<const Renderer> r, std::shared_ptr<Film> f, TaskOptions o, RenderSink& s);

  const RenderSettings& settings() const { return renderer->view().settings; }
  std::optional<Slice> find_slice(Process process) REQUIRES(mutex);
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

  std::optional<Slice> find_census_slice() REQUIRES(mutex);
  void run_census(const Slice& slice) EXCLUDES(mutex);
  void make_census() EXCLUDES(mutex);
  std::optional<LightNotFound> count_particles(const Due& due, double confidence) EXCLUDES(mutex);

  LightBatch light_of(int unit, int last_sample) const;
  void run_part(const Slice& slice) EXCLUDES(mutex);
  void run_reference(const Slice& slice) EXCLUDES(mutex);
  Due begin_references(int samples) EXCLUDES(mutex);
  bool gather(TileState& state, std::stop_token stop) EXCLUDES(mutex);
  Due begin_prepass(int sample) EXCLUDES(mutex);
  Due build_prepass() EXCLUDES(mutex);
  void advance(Due due) EXCLUDES(mutex);
  void publish_splats() EXCLUDES(mutex);
  Due decide(const Due& due) EXCLUDES(mutex);
  Due begin_epoch(int from) EXCLUDES(mutex);
  ErrorEstimate error_now() const;
  double meter_error_now() const;
  ErrorCheck check_error(const Due& due, const PassPolicy& by) EXCLUDES(mutex);
  Due next_after(int samples, StopReason why) EXCLUDES(mutex);
  void end(Due due) EXCLUDES(mutex);
  PassPolicy policy_now() const EXCLUDES(mutex);
  void note(ErrorCheck& check) EXCLUDES(mutex);
  void finish(StopReason why) EXCLUDES(mutex);
};

}  // namespace core
