// The prepass of a task: rounds of parts, run before the samples that look up their result.
#include <memory>
#include <utility>

#include "core/base/cpu_time.h"
#include "core/render/task/render_task_impl.h"

namespace core {

RenderTask::Impl::Due RenderTask::Impl::begin_prepass(int sample) {
  std::shared_ptr<Prepass> started = renderer->start_prepass(sample);
  MutexLock lock(mutex);
  prepass = {.pass = std::move(started)};
  phase = Phase::kPrepass;
  return next_due();
}

RenderTask::Impl::Due RenderTask::Impl::build_prepass() {
  std::shared_ptr<Prepass> traced;
  {
    MutexLock lock(mutex);
    traced = prepass.pass;
  }
  const double cpu_start = thread_cpu_seconds();
  const bool is_ready = traced->build();
  MutexLock lock(mutex);
  prepass.cpu_seconds += thread_cpu_seconds() - cpu_start;
  prepass.parts_out = prepass.parts_done = 0;
  phase = is_ready ? Phase::kRendering : Phase::kPrepass;
  return next_due();
}

void RenderTask::Impl::run_part(const Slice& slice) {
  std::shared_ptr<Prepass> traced;
  {
    MutexLock lock(mutex);
    traced = prepass.pass;
  }
  const double cpu_start = thread_cpu_seconds();
  std::uint64_t rays = 0;
  renderer->run_prepass(*traced, slice.tile, rays);
  Due due;
  {
    MutexLock lock(mutex);
    ++prepass.parts_done;
    prepass.rays += rays;
    prepass.cpu_seconds += thread_cpu_seconds() - cpu_start;
    --in_flight;
    note_clock();
    due = next_due();
  }
  advance(std::move(due));
}

/// Renders one sample of a tile. The first sample that a prepass serves is charged the tile's share
/// of its cost.
bool RenderTask::Impl::gather(TileState& state, std::stop_token stop) {
  PrepassWork from;
  {
    MutexLock lock(mutex);
    from = prepass;
  }
  const bool is_first = state.samples == from.pass->sample();
  const bool whole = renderer->gather(state, *from.pass, std::move(stop));
  if (is_first) {
    const PixelRect crop = film->crop();
    const double share = static_cast<double>(state.rect.width) * state.rect.height /
                         (static_cast<double>(crop.width) * crop.height);
    state.cpu_seconds += from.cpu_seconds * share;
    state.rays += static_cast<std::uint64_t>(static_cast<double>(from.rays) * share);
  }
  return whole;
}

}  // namespace core
