/// Pilot: a job rendered small for a moment, to say what the whole will cost.
///
/// A source of slices for the scheduler; the requesting thread waits for it.
#pragma once

#include <atomic>
#include <memory>

#include "api/job_spec.h"
#include "core/base/mutex.h"
#include "core/render/render_task.h"
#include "server/jobs/scheduler.h"

namespace server {

struct CostEstimate {
  double seconds = 0;  ///< On an idle server with that many threads.
  double seconds_low = 0;
  double seconds_high = 0;
  double cpu_seconds = 0;
  double samples_per_pixel = 0;  ///< That the stop rules will need.
  double memory_bytes = 0;       ///< Film and scene.
  double memory_bytes_low = 0;   ///< The film alone: the scene may be loaded already.
  double memory_bytes_high = 0;  ///< What it is admitted with: while it is loaded, or renders.
  double pilot_cpu_seconds = 0;
};

/// The same job with so few pixels and samples that it takes half a second at most.
api::JobSpec pilot_spec(api::JobSpec spec);

class Pilot final : public SliceSource, private core::RenderSink {
 public:
  /// renderer: of pilot_spec().
  explicit Pilot(std::shared_ptr<const core::Renderer> renderer);

  bool run_slice() override;
  /// Until it is done. False: it has no sample of each pixel after some seconds.
  bool wait();
  /// spec: of the whole job. The interval is that of the mean over tiles, as if they were drawn at
  /// random, widened by a quarter to each side for what another moment of the machine changes.
  /// Memory is left out.
  CostEstimate estimate(const api::JobSpec& spec, int threads, int samples_max) const;

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
