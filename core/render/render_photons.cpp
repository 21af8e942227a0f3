// Photons of a task: traced in parts and made into a map, before each sample that needs them.
#include <memory>
#include <utility>

#include "core/base/cpu_time.h"
#include "core/render/render_task_impl.h"

namespace core {

RenderTask::Impl::Due RenderTask::Impl::begin_photons(int sample) {
  std::shared_ptr<PhotonPass> started = renderer->start_photons(sample);
  MutexLock lock(mutex);
  photons = {.pass = std::move(started)};
  phase = Phase::kTracing;
  return next_due();
}

RenderTask::Impl::Due RenderTask::Impl::make_map() {
  std::shared_ptr<PhotonPass> traced;
  {
    MutexLock lock(mutex);
    traced = photons.pass;
  }
  const double cpu_start = thread_cpu_seconds();
  traced->build();
  MutexLock lock(mutex);
  photons.cpu_seconds += thread_cpu_seconds() - cpu_start;
  phase = Phase::kRendering;
  return next_due();
}

void RenderTask::Impl::run_photons(const Slice& slice) {
  std::shared_ptr<PhotonPass> traced;
  {
    MutexLock lock(mutex);
    traced = photons.pass;
  }
  const double cpu_start = thread_cpu_seconds();
  std::uint64_t rays = 0;
  renderer->trace_photons(*traced, slice.tile, rays);
  Due due;
  {
    MutexLock lock(mutex);
    ++photons.parts_done;
    photons.rays += rays;
    photons.cpu_seconds += thread_cpu_seconds() - cpu_start;
    --in_flight;
    note_clock();
    due = next_due();
  }
  advance(std::move(due));
}

/// One sample of a tile, which bears its share of what the photons cost.
bool RenderTask::Impl::gather(TileState& state, std::stop_token stop) {
  PhotonWork from;
  {
    MutexLock lock(mutex);
    from = photons;
  }
  const bool whole = renderer->gather(state, *from.pass, std::move(stop));
  const PixelRect crop = film->crop();
  const double share = static_cast<double>(state.rect.width) * state.rect.height /
                       (static_cast<double>(crop.width) * crop.height);
  state.cpu_seconds += from.cpu_seconds * share;
  state.rays += static_cast<std::uint64_t>(static_cast<double>(from.rays) * share);
  return whole;
}

}  // namespace core
