// Slices of a task: prepares them, renders them here or elsewhere, and commits them.
#include <algorithm>
#include <utility>

#include "core/film/meter_reading.h"
#include "core/integrators/registry.h"
#include "core/render/picture/unsampled_light.h"
#include "core/render/task/render_task_impl.h"
#include "core/render/units/slice_work.h"
#include "core/settings/sample_sets.h"

namespace core {

RenderTask::Impl::Due RenderTask::Impl::begin_references(int samples) {
  references->begin(samples);
  MutexLock lock(mutex);
  phase = Phase::kComparing;
  return next_due();
}

void RenderTask::Impl::run_reference(const Slice& slice) {
  references->run(slice);
  Due due;
  {
    MutexLock lock(mutex);
    --in_flight;
    note_clock();
    due = next_due();
  }
  advance(std::move(due));
}

/// Returns the error of the film as it is now; unknown for biased images without references.
ErrorEstimate RenderTask::Impl::error_now() const {
  if (references != nullptr) {
    return references->error_of(*film);
  }
  return halves_show_error(settings()) ? ErrorEstimate(*film)
                                       : ErrorEstimate(std::span<const TileSums>(), film->errors());
}

double RenderTask::Impl::meter_error_now() const {
  return meter_error(meter_readings(meter_points(settings().meter), film->meter(),
                                    unsampled_path_light(renderer->view())));
}

/// Returns the light samples that the unit lacks up to last_sample.
LightBatch RenderTask::Impl::light_of(int unit, int last_sample) const {
  LightBatch light;
  light.unit = unit;
  if (film->has_splats()) {
    light.first_sample = film->light_samples(unit);
    light.last_sample = std::max(light.first_sample, last_sample);
    light.splats.resize(static_cast<std::size_t>(film->replicates()));
  }
  return light;
}

bool RenderTask::can_lend() const {
  const IntegratorEntry* row = find_integrator(impl_->settings().integrator);
  MutexLock lock(impl_->mutex);
  return impl_->phase != Impl::Phase::kComparing && (row == nullptr || !row->keeps_prepass);
}

SliceWork RenderTask::prepare(const Slice& slice, double seconds) const {
  const Impl& m = *impl_;
  SliceWork work;
  work.slice = slice;
  const auto cut = [&](double pixels, const auto& state) {
    const int length = slice_length(pixels, state.samples, state.cpu_seconds, seconds);
    work.slice.last_sample = std::min(slice.last_sample, slice.first_sample + length);
    work.expected_seconds = seconds_of_sample(pixels, state.samples, state.cpu_seconds);
  };
  if (slice.tile >= m.film->unit_count()) {
    work.chunk = slice.tile - m.film->unit_count();
    work.meter = m.film->meter_chunk(work.chunk);
    cut(kMeterChunk * kMeterReplicates, work.meter);
  } else {
    const bool has_pixels = slice.tile < m.film->tile_count();
    // Slices of units outside the crop are as long as those of the first tile.
    TileState state = m.film->tile(has_pixels ? slice.tile : 0);
    cut(static_cast<double>(state.rect.width) * state.rect.height, state);
    if (has_pixels) {
      const int window = shared_window(m.settings());
      const int end = (work.slice.last_sample + window - 1) / window * window;
      work.slice.last_sample = integrator_has_prepass(m.settings())
                                   ? slice.first_sample + 1
                                   : std::min(slice.last_sample, end);
      work.state = std::move(state);
    }
    work.unit = m.film->unit_rect(slice.tile);
    if (slice.kind == SliceKind::kPicture) {
      work.light = m.light_of(slice.tile, work.slice.last_sample);
    }
  }
  work.expected_seconds *= work.slice.last_sample - slice.first_sample;
  return work;
}

void RenderTask::run(const Slice& slice) {
  Impl& m = *impl_;
  if (slice.kind == SliceKind::kPrepass) {
    m.run_part(slice);
    return;
  }
  if (slice.kind == SliceKind::kReference) {
    m.run_reference(slice);
    return;
  }
  if (slice.kind == SliceKind::kCensus) {
    m.run_census(slice);
    return;
  }
  SliceWork work = prepare(slice, m.slice_seconds);
  const bool has_prepass =
      slice.kind == SliceKind::kPicture && work.chunk < 0 && integrator_has_prepass(m.settings());
  const std::stop_token stop = m.stop_source.get_token();
  // A unit outside the crop has no pixels.
  const bool whole = has_prepass ? (work.state.pixels.empty() || m.gather(work.state, stop)) &&
                                       m.renderer->render_light(work.unit, work.light, stop)
                                 : render_slice(*m.renderer, work, stop);
  if (whole) {
    accept(std::move(work));
  } else {
    give_back(slice);
  }
}

void RenderTask::accept(SliceWork done) {
  Impl& m = *impl_;
  const Slice slice = done.slice;
  std::optional<TileState> before;
  if (done.chunk >= 0) {
    m.film->commit_meter(done.chunk, std::move(done.meter));
  } else if (slice.kind == SliceKind::kPilot) {
    m.film->keep(slice.tile, std::move(done.state));
  } else if (slice.tile < m.film->tile_count()) {
    if (m.policy_now().has_clock()) {
      before = m.film->tile(slice.tile);
    }
    done.state.cpu_seconds += done.light.cpu_seconds;
    m.sink.on_tile(slice.tile, m.film->commit(slice.tile, std::move(done.state), done.light));
  } else {
    m.film->commit_light({&done.light, 1});
  }
  m.advance(m.complete(slice, slice.last_sample, std::move(before)));
}

void RenderTask::accept(std::vector<SliceWork> unit) {
  // The first slice holds the sums of all; they are committed together, before the tiles.
  std::vector<LightBatch> light;
  for (SliceWork& each : unit) {
    light.push_back(std::exchange(each.light, {}));
    if (each.slice.tile < impl_->film->tile_count()) {
      each.light.cpu_seconds = std::exchange(light.back().cpu_seconds, 0);
    }
  }
  if (impl_->film->has_splats()) {
    impl_->film->commit_light(light);
  }
  for (SliceWork& each : unit) {
    accept(std::move(each));
  }
}

void RenderTask::give_back(const Slice& slice) {
  impl_->advance(impl_->complete(slice, slice.first_sample, std::nullopt));
}

bool RenderTask::is_stopping() const { return impl_->stop_source.stop_requested(); }

}  // namespace core
