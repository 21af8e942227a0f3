// The meter's part of a task.
#include <utility>

#include "core/render/render_task_impl.h"

namespace core {

void RenderTask::Impl::run_meter(const Slice& slice) {
  const int chunk = slice.tile - film->unit_count();
  MeterChunk state = film->meter_chunk(chunk);
  const int length =
      slice_length(kMeterChunk * kMeterReplicates, state.samples, state.cpu_seconds, slice_seconds);
  const int last = std::min(slice.last_sample, slice.first_sample + length);
  const bool whole = renderer->render_meter(chunk, state, last, stop_source.get_token());
  if (whole) {
    film->commit_meter(chunk, std::move(state));
  }
  advance(complete(slice, whole ? last : slice.first_sample, std::nullopt));
}

}  // namespace core
