/// Pilot: renders a small version of a job for a moment, to estimate the cost of the whole.
///
/// A source of slices for the scheduler; the requesting thread waits for it.
#pragma once

#include <memory>
#include <stop_token>

#include "api/answers/dry_run.h"
#include "api/job/job_spec.h"
#include "core/base/mutex.h"
#include "core/render/task/render_task.h"
#include "server/jobs/scheduler.h"

namespace server {

/// CPU seconds per sample of one pixel.
struct PathCost {
  double mean = 0;
  double low = 0;  ///< 95% interval
  double high = 0;
};
/// The interval is that of the mean over tiles, treated as a random sample (Student's t), widened
/// by a quarter on each side for variation of the machine's speed. One or two tiles do not show
/// their spread: half to three halves of the mean, so widened.
PathCost path_cost(const core::Film& film);

/// Returns the job with so few pixels and samples that it takes at most half a second.
api::JobSpec pilot_spec(api::JobSpec spec);

class Pilot final : public SliceSource, private core::RenderSink {
 public:
  /// renderer: of pilot_spec().
  explicit Pilot(std::shared_ptr<const core::Renderer> renderer);

  bool run_slice() override;
  /// Waits until it is done. Returns false when not every pixel has a sample after some seconds, or
  /// at a stop.
  bool wait(const std::stop_token& stop);
  /// spec: of the whole job. The interval is that of path_cost(), and of the samples for an error
  /// target. Memory is not filled in.
  api::CostView estimate(const api::JobSpec& spec, int threads, int samples_max) const;

 private:
  void on_tile(int /*tile*/, std::uint32_t /*revision*/) override {}
  void on_pass(const core::ConvergencePoint& /*point*/) override {}
  void on_finished(core::StopReason reason) override;
  void end();

  const std::shared_ptr<core::Film> film_;
  core::RenderTask task_;
  core::Mutex mutex_;
  core::CondVar done_;
  bool is_done_ GUARDED_BY(mutex_) = false;
};

}  // namespace server
