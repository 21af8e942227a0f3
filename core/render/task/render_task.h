/// RenderTask: renders one image in slices, on threads of the caller.
///
/// A slice is (tile, samples [first, last)): the tile's camera paths and, if the integrator splats,
/// the light paths of its unit. Units outside the crop have light paths only; slices for chunks of
/// a meter's points come last. In each pass every tile reaches the same sample count before a
/// decision (stop, check the error), so the final film does not depend on threads. With adaptive
/// sampling an epoch begins at some of these counts: pilot slices are rendered first, then the
/// epoch is planned and every tile gets its samples. If camera paths need a prepass, every pass is
/// one sample, preceded by the slices of the prepass. PassPolicy determines the order; the task
/// keeps the tiles, the clock and the order of calls. The owner of the threads calls take() and
/// run(); run() notifies the sink.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "core/film/film.h"
#include "core/render/picture/renderer.h"
#include "core/render/task/progress.h"
#include "core/settings/settings.h"

namespace core {

enum class SliceKind {
  kPicture,
  kPilot,      ///< samples belong to the pilot stream
  kPrepass,    ///< part `tile` of the prepass
  kReference,  ///< of the reference images (core/render/task/reference_images.h)
  kCensus      ///< part `tile` of the census of particles; -1: its points
};

struct Slice {
  int tile = 0;  ///< or a unit outside the crop, from Film::tile_count() on, or a chunk of the
                 ///< meter, from Film::unit_count() on
  int first_sample = 0;
  int last_sample = 0;
  SliceKind kind = SliceKind::kPicture;
};

struct SliceWork;  // core/render/units/slice_work.h

/// Called from worker threads without locks held; must return quickly.
class RenderSink {
 public:
  virtual ~RenderSink() = default;
  virtual void on_tile(int tile, std::uint32_t revision) = 0;
  virtual void on_pass(const ConvergencePoint& point) = 0;
  virtual void on_finished(StopReason reason) = 0;
};

class NullSink final : public RenderSink {
 public:
  void on_tile(int /*tile*/, std::uint32_t /*revision*/) override {}
  void on_pass(const ConvergencePoint& /*point*/) override {}
  void on_finished(StopReason /*reason*/) override {}
};

struct TaskOptions {
  StopRules stop;
  /// The server's maximum. The stop reason is kLimit if no rule applied earlier.
  int samples_limit = 65536;
  double elapsed_before = 0;  ///< seconds spent before a restart
  double slice_target_seconds = 0.02;
  std::vector<ConvergencePoint> points_before;
  /// Whether errors of biased integrators are measured; they are unknown otherwise.
  bool compares = true;
  /// Whether particles are counted beside the picture, for LightNotFound.
  bool counts_particles = false;
  std::optional<LightNotFound> light_not_found_before = {};
  /// Returns the upper end of the error of the film's denoised image; infinite if unknown. Called
  /// by one thread at checks of jobs with stop.denoised_error, while no slice of the task is out.
  /// If empty, such a rule never ends the task.
  std::function<double(const Film& film, double confidence)> denoised_bound = {};
};

class RenderTask {
 public:
  /// film: empty or restored from a checkpoint; made for the renderer's view. The sink must outlive
  /// the task.
  RenderTask(std::shared_ptr<const Renderer> renderer, std::shared_ptr<Film> film,
             TaskOptions options, RenderSink& sink);
  ~RenderTask();
  RenderTask(const RenderTask&) = delete;
  RenderTask& operator=(const RenderTask&) = delete;

  /// The process that computes a slice.
  enum class Process {
    kThis,  ///< by run()
    kOther  ///< from the result of prepare(); it also traces the photons that it looks up
  };
  /// Returns the next slice. Empty if none is available now (others are still running) or if the
  /// task is paused or over.
  std::optional<Slice> take(Process process = Process::kThis);
  /// Renders and commits a slice from take(). The last slice of a pass also makes the decisions.
  void run(const Slice& slice);

  /// Returns whether slices can be rendered in other processes now. False if one prepass serves all
  /// samples, because every process would have to repeat it, and for reference images.
  bool can_lend() const;
  /// Returns the input of a slice from take(), shortened to about `seconds` of CPU time. Must be
  /// followed by accept() or give_back(). Pre: not a prepass slice.
  SliceWork prepare(const Slice& slice, double seconds) const;
  /// Commits a slice that was rendered elsewhere, as run() does.
  void accept(SliceWork done);
  /// Commits slices that were rendered together elsewhere.
  void accept(std::vector<SliceWork> unit);
  /// Returns the estimated CPU seconds of the slices of this pass that are not handed out yet.
  double seconds_to_hand_out() const;
  /// Returns a slice unrendered; take() hands it out again.
  void give_back(const Slice& slice);
  /// Returns whether the task accepts no more slices; slices in flight need not be finished.
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

/// Runs a task to its end on `threads` new threads; for programs without a scheduler.
void run_to_end(RenderTask& task, int threads);

}  // namespace core
