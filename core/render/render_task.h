/// RenderTask: one picture being made, as slices for whichever threads come along.
///
/// A slice is (tile, samples [first, last)). Passes: every tile gets to the same sample count before
/// a decision (stop, error look) is taken, so what the film holds at the end does not depend on
/// threads. Where sampling is adaptive, decisions are also where an epoch may begin (core/render/pass_plan.h): pilot slices
/// come first, then the plan is made and every tile gets its part. What plans and error targets need to know of the scene's lights is looked
/// for meanwhile, a slice at a time; a decision that needs probes of pixels waits until slices have made them. The owner of the threads calls
/// take() and run(); run() tells the sink.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "core/base/mutex.h"
#include "core/base/result.h"
#include "core/film/error_estimate.h"
#include "core/film/film.h"
#include "core/render/eta.h"
#include "core/render/light_edges.h"
#include "core/render/settings.h"
#include "core/render/view.h"

namespace core {

class Renderer;

enum class SliceKind {
  kPicture,
  kPilot,  ///< samples are of the pilot stream
  kEdges,  ///< a part of the search for light edges; of no tile
  kProbe   ///< of one pixel, which a decision waits for; of no tile
};

struct Slice {
  int tile = 0;
  int first_sample = 0;
  int last_sample = 0;
  SliceKind kind = SliceKind::kPicture;
};

struct ConvergencePoint {
  int samples_per_pixel = 0;
  double elapsed_seconds = 0;
  double cpu_seconds = 0;
  std::uint64_t rays = 0;
  ErrorInterval error;
};

struct Progress {
  double fraction = 0;  ///< below 1 until the end; does not fall while the stop rules stay
  int samples_min = 0;
  double samples_mean = 0;
  int samples_max = 0;
  double elapsed_seconds = 0;
  double cpu_seconds = 0;
  std::optional<double> eta_seconds;
  std::optional<double> eta_low_seconds;  ///< interval of eta_seconds, as long as the pace stays what it was
  std::optional<double> eta_high_seconds;
  std::uint64_t rays = 0;
  double rays_per_second = 0;
  std::uint64_t rejected_samples = 0;
  ErrorInterval error;  ///< of the last complete pass that was looked at; NaN before
  double efficiency = 0;  ///< 1 / (relative error^2 * CPU seconds); NaN when unknown
  std::uint32_t revision = 0;
};

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
  /// camera), "/film/crop".
  static Result<std::shared_ptr<const Renderer>> create(View view);
  virtual ~Renderer() = default;
  virtual const View& view() const noexcept = 0;
  /// What `measured` splitting found to be best; 0 with other types.
  virtual int measured_split_count() const noexcept { return 0; }
  /// Renders samples [state.samples, last_sample) of every pixel of state.rect into `state`, in
  /// order; where there is a plan, what it has between these means. Returns false, leaving `state` half done, when stop was requested.
  virtual bool render(TileState& state, int last_sample, std::stop_token stop) const = 0;
  /// The same for pilot samples [state.pilot_samples, last_sample), which are independent of all others.
  virtual bool render_pilot(TileState& state, int last_sample, std::stop_token stop) const = 0;
  /// A search for the pixels of the crop that see lights in part; not longer than the renderer lives.
  virtual std::unique_ptr<LightEdgeSearch> light_edge_search() const = 0;
  /// Expected values of pixels of the crop (row by row), each from `samples` samples, even, that are in no picture. Empty when stop was
  /// requested.
  virtual std::vector<ProbedPixel> probe(std::span<const std::uint32_t> pixels, int samples, std::stop_token stop) const = 0;
};

struct TaskOptions {
  StopRules stop;
  int samples_limit = 65536;  ///< the server's maximum: stop reason kLimit when no rule ended it first
  double elapsed_before = 0;  ///< seconds already spent before a restart
  double slice_target_seconds = 0.02;
  double report_share = 0.05;  ///< of the processor's time that errors told on the way may take
  std::vector<ConvergencePoint> points_before;
};

class RenderTask {
 public:
  /// film: empty or restored from a checkpoint, made for renderer's view. sink outlives the task.
  RenderTask(std::shared_ptr<const Renderer> renderer, std::shared_ptr<Film> film,
             TaskOptions options, RenderSink& sink);
  ~RenderTask();
  RenderTask(const RenderTask&) = delete;
  RenderTask& operator=(const RenderTask&) = delete;

  /// The next slice, or empty: nothing to hand out now (others are still running), paused or over.
  std::optional<Slice> take();
  /// Renders and commits a slice that take() gave. The last one of a pass takes the decisions.
  void run(const Slice& slice);

  void cancel();                    ///< slices in flight stop within a row of pixels; then on_finished(kCancelled)
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
