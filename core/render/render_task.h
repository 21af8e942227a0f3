/// RenderTask: one picture being made, as slices for whichever threads come along.
///
/// A slice is (tile, samples [first, last)): the tile's camera paths and, where the integrator
/// splats, light paths of its unit; units outside of the crop have light paths alone, and chunks of
/// a meter's points come after them. Passes: every
/// tile gets to the same sample count before a decision (stop, look at the error), so the film at
/// the end does not depend on threads. Where sampling is adaptive, an epoch begins at some of them:
/// pilot slices come first, then the plan is made and every tile gets its part. Where camera paths
/// need a prepass, every pass is one sample, and the slices of the prepass come before it.
/// PassPolicy says what comes when; the task keeps the tiles, the clock and the order of calls. The
/// owner of the threads calls take() and run(); run() tells the sink.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "core/base/result.h"
#include "core/film/film.h"
#include "core/integrators/prepass.h"
#include "core/render/progress.h"
#include "core/render/view.h"
#include "core/settings/settings.h"

namespace core {

enum class SliceKind {
  kPicture,
  kPilot,   ///< samples are of the pilot stream
  kPrepass  ///< the part of the prepass that `tile` says
};

struct Slice {
  int tile = 0;  ///< or a unit outside of the crop: from Film::tile_count() on; or a chunk of the
                 ///< meter: from Film::unit_count() on
  int first_sample = 0;
  int last_sample = 0;
  SliceKind kind = SliceKind::kPicture;
};

struct SliceWork;  // core/render/slice_work.h

/// Called from the worker threads, without locks held; must be quick.
class RenderSink {
 public:
  virtual ~RenderSink() = default;
  virtual void on_tile(int tile, std::uint32_t revision) = 0;
  virtual void on_pass(const ConvergencePoint& point) = 0;
  virtual void on_finished(StopReason reason) = 0;
};

/// Everything that takes memory or time to prepare for a view: camera, light sampler, tables.
/// Immutable and thread-safe.
class Renderer {
 public:
  /// Errors: kInvalidArgument with where "/camera/..." (no such camera, fov of an orthographic
  /// camera), "/film/crop", "/integrator/type" (the scene has what it does not render).
  static Result<std::shared_ptr<const Renderer>> create(View view);
  virtual ~Renderer() = default;
  virtual const View& view() const noexcept = 0;
  /// What `measured` splitting found to be best; 0 with other types.
  virtual int measured_split_count() const noexcept { return 0; }
  /// Renders samples [state.samples, last_sample) of every pixel of state.rect into `state`, in
  /// order; where there is a plan, what it has between these means. Returns false, leaving `state`
  /// half done, when stop was requested.
  virtual bool render(TileState& state, int last_sample, std::stop_token stop) const = 0;
  /// Light paths [light.first_sample, light.last_sample) of every pixel of the unit into `light`,
  /// where the integrator splats. False when stop was requested.
  virtual bool render_light(PixelRect, LightBatch&, std::stop_token) const { return true; }
  /// The same for pilot samples [state.pilot_samples, last_sample), which are independent of all
  /// others.
  virtual bool render_pilot(TileState& state, int last_sample, std::stop_token stop) const = 0;
  /// Brings a chunk of the job's meter to last_sample. False when stop was requested.
  virtual bool render_meter(int /*chunk*/, MeterChunk&, int /*last_sample*/,
                            std::stop_token) const {
    return true;
  }
  /// Null: samples need none. As Integrator::start_prepass().
  virtual std::unique_ptr<Prepass> start_prepass(int) const { return nullptr; }
  virtual void run_prepass(Prepass&, int /*part*/, std::uint64_t& /*rays*/) const {}
  /// As render() for the sample that follows state.samples, which the pass serves.
  virtual bool gather(TileState&, const Prepass&, std::stop_token) const { return true; }
};

struct TaskOptions {
  StopRules stop;
  /// The server's maximum: stop reason kLimit when no rule ended it first.
  int samples_limit = 65536;
  double elapsed_before = 0;  ///< seconds already spent before a restart
  double slice_target_seconds = 0.02;
  std::vector<ConvergencePoint> points_before;
  /// Upper bound of the error of the film's denoised picture, exceeded with probability alpha at
  /// most; infinite where it is not known. Asked at looks of jobs with stop.denoised_error, by one
  /// thread, while no slice of the task is out. Empty: such a rule never ends the task.
  std::function<double(const Film& film, double alpha)> denoised_bound = {};
};

class RenderTask {
 public:
  /// film: empty or restored from a checkpoint, made for renderer's view. sink outlives the task.
  RenderTask(std::shared_ptr<const Renderer> renderer, std::shared_ptr<Film> film,
             TaskOptions options, RenderSink& sink);
  ~RenderTask();
  RenderTask(const RenderTask&) = delete;
  RenderTask& operator=(const RenderTask&) = delete;

  /// Where a slice is rendered.
  enum class Place {
    kHere,      ///< by run()
    kElsewhere  ///< from what prepare() gives; photons that it looks up are traced there
  };
  /// The next slice, or empty: nothing to hand out now (others are still running), paused or over.
  std::optional<Slice> take(Place place = Place::kHere);
  /// Renders and commits a slice that take() gave. The last one of a pass takes the decisions.
  void run(const Slice& slice);

  /// Can slices be rendered elsewhere? Not where a prepass serves all samples: every process would
  /// have to make all of it anew.
  bool can_lend() const;
  /// What a slice of take() needs, cut to some CPU seconds. accept() or give_back() has to follow.
  /// Pre: not of a prepass.
  SliceWork prepare(const Slice& slice, double seconds) const;
  /// Commits what became of it, as run() does.
  void accept(SliceWork done);
  /// The same for slices that were rendered together elsewhere.
  void accept(std::vector<SliceWork> unit);
  /// CPU seconds that the slices of this pass take which are not out.
  double seconds_to_hand_out() const;
  /// The slice was not rendered: take() gives it again.
  void give_back(const Slice& slice);
  /// The task wants no slice any more: those that are out need not be finished.
  bool is_stopping() const;

  void cancel();  ///< slices in flight stop within a row of pixels or a wave; then
                  ///< on_finished(kCancelled)
  void set_paused(bool paused);
  void set_stop(const StopRules& stop);  ///< takes effect at the next decision
  bool finished() const;
  StopReason stop_reason() const;
  Progress progress() const;
  std::vector<ConvergencePoint> points() const;
  const Film& film() const noexcept;
  const Renderer& renderer() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Runs a task to its end on `threads` threads of its own; for programs without a scheduler.
void run_to_end(RenderTask& task, int threads);

}  // namespace core
