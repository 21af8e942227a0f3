#include <algorithm>
#include <atomic>
#include <chrono>
#include <limits>
#include <thread>
#include <utility>

#include "core/base/mutex.h"
#include "core/base/parallel_for.h"
#include "core/integrators/census.h"
#include "core/integrators/registry.h"
#include "core/render/picture/light_not_found.h"
#include "core/render/task/allocation.h"
#include "core/render/task/pass_plan.h"
#include "core/render/task/pass_policy.h"
#include "core/render/task/progress_meter.h"
#include "core/render/task/render_task_impl.h"

namespace core {
namespace {

bool is_past(const std::optional<double>& unix_seconds) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return unix_seconds && std::chrono::duration<double>(now).count() >= *unix_seconds;
}

}  // namespace

RenderTask::Impl::Impl(std::shared_ptr<const Renderer> r, std::shared_ptr<Film> f, TaskOptions o,
                       RenderSink& s)
    : renderer(std::move(r)),
      film(std::move(f)),
      samples_limit(o.samples_limit),
      slice_seconds(o.slice_target_seconds),
      denoised_bound(std::move(o.denoised_bound)),
      references(o.compares ? ReferenceImages::create(renderer->view(), slice_seconds) : nullptr),
      sink(s),
      policy(renderer->view().settings, o.stop, o.samples_limit),
      meter(std::move(o.points_before)) {
  MutexLock lock(mutex);
  clock.before = o.elapsed_before;
  census.is_wanted = o.counts_particles && has_census(renderer->view());
  light_not_found = std::move(o.light_not_found_before);
  for (int t = 0; t < film->unit_count(); ++t) {
    const bool has_pixels = t < film->tile_count();
    const int pilot = film->has_pilot() ? film->tile(t).pilot_samples : 0;
    const int light = film->has_splats() ? film->light_samples(t) : film->tile_samples(t);
    tiles.push_back({has_pixels ? std::min(light, film->tile_samples(t)) : light, pilot, false});
    pass.target = std::max(pass.target, tiles.back().samples);
    pass.base = t == 0 ? tiles.back().samples : std::min(pass.base, tiles.back().samples);
  }
  for (int chunk = 0; chunk < film->meter_chunk_count(); ++chunk) {
    const int samples = film->meter_chunk(chunk).samples;
    tiles.push_back({samples, std::numeric_limits<int>::max(), false});
    pass.target = std::max(pass.target, samples);
    pass.base = std::min(pass.base, samples);
  }
  pass.base_is_whole = pass.base == pass.target;
  if (pass.base > 0 && pass.base_is_whole && policy.checks_at(pass.base)) {
    --pass.base;  // The process may have ended before it decided here, so the check is due again.
  }
  if (film->has_plan()) {
    const PlanSpan span = film->tile(0).span;  // the same for all tiles
    pass.planned_to = span.to > 0 ? span.to : first_epoch(settings());
  }
}

bool RenderTask::Impl::all_have(int Tile::*samples, int count) const {
  return std::all_of(tiles.begin(), tiles.end(),
                     [&](const Tile& tile) { return tile.*samples >= count; });
}

std::optional<Slice> RenderTask::Impl::find_slice_of(SliceKind kind) {
  const bool is_pilot = kind == SliceKind::kPilot;
  const int target = is_pilot ? pilot_target() : pass.target;
  for (std::size_t step = 0; step < tiles.size(); ++step) {
    const std::size_t t = (cursor + step) % tiles.size();
    Tile& tile = tiles[t];
    const int has = is_pilot ? tile.pilot_samples : tile.samples;
    if (!tile.is_out && has < target) {
      cursor = (t + 1) % tiles.size();
      tile.is_out = true;
      ++in_flight;
      return Slice{static_cast<int>(t), has, target, kind};
    }
  }
  return std::nullopt;
}

std::optional<Slice> RenderTask::Impl::find_slice(Process process) {
  if (phase == Phase::kPiloting) {
    return find_slice_of(SliceKind::kPilot);
  }
  if (phase == Phase::kPrepass && process == Process::kThis) {
    if (prepass.parts_out == prepass.pass->part_count()) {
      return std::nullopt;
    }
    ++in_flight;
    return Slice{prepass.parts_out++, 0, 0, SliceKind::kPrepass};
  }
  if (phase == Phase::kComparing) {
    auto slice = process == Process::kThis ? references->take() : std::nullopt;
    in_flight += slice ? 1 : 0;
    return slice;
  }
  if (phase == Phase::kRendering && needs_prepass()) {
    return std::nullopt;
  }
  if (process == Process::kThis) {
    if (const auto part = find_census_slice()) {
      return part;
    }
  }
  auto slice = find_slice_of(SliceKind::kPicture);
  while (!slice && pass.target < policy.barrier(pass)) {
    pass.target = process == Process::kOther ? policy.far_target(pass) : policy.next_target(pass);
    slice = find_slice_of(SliceKind::kPicture);
  }
  return slice;
}

/// Returns whether a prepass is due before the pass beyond pass.base.
bool RenderTask::Impl::needs_prepass() const {
  return integrator_has_prepass(settings()) && pass.base < policy.barrier(pass) &&
         (prepass.pass == nullptr || !prepass.pass->serves(pass.base));
}

void RenderTask::Impl::note_clock() {
  if (ending != StopReason::kNone || pass.base < 1 || !pass.base_is_whole) {
    return;
  }
  const StopRules& stop = policy.stop();
  if (stop.seconds && clock.seconds() >= *stop.seconds) {
    ending = StopReason::kSeconds;
  } else if (stop.cpu_seconds && film->cpu_seconds() >= *stop.cpu_seconds) {
    ending = StopReason::kCpuSeconds;
  } else if (is_past(stop.deadline_unix_seconds)) {
    ending = StopReason::kDeadline;
  }
  if (ending != StopReason::kNone) {
    stop_source.request_stop();
  }
}

/// Returns the decision that is due when no slice is out. The thread that receives it makes it; no
/// other does until the phase changes.
RenderTask::Impl::Due RenderTask::Impl::next_due() {
  if (in_flight > 0 || phase == Phase::kDeciding || phase == Phase::kOver) {
    return {};
  }
  if (ending != StopReason::kNone) {
    return due_end();
  }
  Due due;
  if (phase == Phase::kComparing) {
    if (!references->is_done()) {
      return due;
    }
    phase = Phase::kRendering;
  }
  if (phase == Phase::kPiloting) {
    due.step = all_have(&Tile::pilot_samples, pilot_target()) ? Step::kPlan : Step::kNone;
    due.samples = pass.planned_to;
  } else if (all_have(&Tile::samples, pass.target) && pass.target >= policy.barrier(pass)) {
    due.samples = pass.target;
    if (references != nullptr && policy.checks_at(due.samples) && references->lacks(due.samples)) {
      due.step = Step::kCompare;
      phase = Phase::kDeciding;
      return due;
    }
    due.step = Step::kPass;
    due.checks_error = policy.checks_at(due.samples);
    due.is_news = meter.points().empty() || meter.points().back().samples_per_pixel != due.samples;
    meter.note_pass(due.samples, clock.seconds());
    pass.base = pass.target;
    pass.base_is_whole = true;
    pass_base.clear();
  } else if (phase == Phase::kPrepass) {
    due.step = prepass.parts_done == prepass.pass->part_count() ? Step::kBuild : Step::kNone;
  } else if (needs_prepass()) {
    due.step = Step::kPrepass;
    due.samples = pass.base;
  }
  phase = due.step == Step::kNone ? phase : Phase::kDeciding;
  return due;
}

RenderTask::Impl::Due RenderTask::Impl::due_end() {
  Due due;
  due.step = Step::kEnd;
  due.why = ending;
  if (policy.has_clock() && ending != StopReason::kCancelled &&
      !all_have(&Tile::samples, pass.target)) {
    due.taken_back.swap(pass_base);
    for (const auto& [tile, state] : due.taken_back) {
      tiles[static_cast<std::size_t>(tile)].samples = state.samples;
    }
  }
  due.samples = std::min_element(tiles.begin(), tiles.end(), [](const Tile& a, const Tile& b) {
                  return a.samples < b.samples;
                })->samples;
  // A cancelled job must end soon, so it keeps its last error estimate.
  due.is_news = ending != StopReason::kCancelled && due.samples > 0 &&
                (meter.points().empty() || meter.points().back().samples_per_pixel != due.samples);
  due.checks_error = due.is_news;
  phase = Phase::kDeciding;
  return due;
}

/// last: samples that the tile has now, which are fewer if the slice was stopped.
RenderTask::Impl::Due RenderTask::Impl::complete(const Slice& slice, int last,
                                                 std::optional<TileState> before) {
  MutexLock lock(mutex);
  Tile& tile = tiles[static_cast<std::size_t>(slice.tile)];
  (slice.kind == SliceKind::kPilot ? tile.pilot_samples : tile.samples) = last;
  tile.is_out = false;
  --in_flight;
  if (before && policy.has_clock()) {
    pass_base.try_emplace(slice.tile, std::move(*before));
  }
  note_clock();
  return next_due();
}

void RenderTask::Impl::advance(Due due) {
  while (due.step != Step::kNone) {
    switch (due.step) {
      case Step::kPass:
        due = decide(due);
        break;
      case Step::kPlan:
        due = begin_epoch(due.samples);
        break;
      case Step::kPrepass:
        due = begin_prepass(due.samples);
        break;
      case Step::kBuild:
        due = build_prepass();
        break;
      case Step::kCompare:
        due = begin_references(due.samples);
        break;
      case Step::kEnd:
        end(std::move(due));
        return;
      case Step::kNone:
        break;
    }
  }
}

/// Makes the splats that light paths added to other tiles visible.
void RenderTask::Impl::publish_splats() {
  const std::vector<std::uint32_t> revisions = film->publish_splats();
  for (std::size_t t = 0; t < revisions.size(); ++t) {
    sink.on_tile(static_cast<int>(t), revisions[t]);
  }
}

RenderTask::Impl::Due RenderTask::Impl::decide(const Due& due) {
  publish_splats();
  const PassPolicy by = policy_now();
  ErrorCheck check = due.checks_error ? check_error(due, by) : ErrorCheck{};
  if (due.checks_error && by.denoises_at(due.samples) && denoised_bound) {
    check.denoised_bound = denoised_bound(*film, by.stop().confidence);
  }
  const double at_most = check.light_not_found ? check.light_not_found->at_most
                                               : std::numeric_limits<double>::infinity();
  if (due.checks_error && by.stop().meter_error && by.allows_missing(at_most) &&
      by.ends_by_meter(due.samples, meter_error_now())) {
    return next_after(due.samples, StopReason::kMeterError);
  }
  return next_after(due.samples,
                    by.decide(due.samples, check.bound, check.denoised_bound, at_most));
}

/// Plans the epoch that begins at the current samples.
RenderTask::Impl::Due RenderTask::Impl::begin_epoch(int from) {
  film->install_plans({from, epoch_end(from)}, make_plans(*film, settings(), from));
  MutexLock lock(mutex);
  pass.planned_to = epoch_end(from);
  phase = Phase::kRendering;
  return next_due();
}

RenderTask::Impl::Due RenderTask::Impl::next_after(int samples, StopReason why) {
  MutexLock lock(mutex);
  ending = why == StopReason::kNone ? ending : why;
  phase = samples == pass.planned_to ? Phase::kPiloting : Phase::kRendering;
  return next_due();
}

void RenderTask::Impl::end(Due due) {
  for (auto& [tile, state] : due.taken_back) {
    sink.on_tile(tile, film->commit(tile, std::move(state)));
  }
  publish_splats();
  if (due.checks_error) {
    check_error(due, policy_now());
  }
  finish(due.why);
  sink.on_finished(due.why);
}

PassPolicy RenderTask::Impl::policy_now() const {
  MutexLock lock(mutex);
  return policy;
}

/// Estimates the error once; records changes and sends them to the sink.
RenderTask::Impl::ErrorCheck RenderTask::Impl::check_error(const Due& due, const PassPolicy& by) {
  if (references != nullptr) {
    film->add_cpu_seconds(references->take_cpu_seconds());
  }
  const ErrorEstimate estimate = error_now();
  ErrorCheck check;
  check.point.samples_per_pixel = due.samples;
  check.point.cpu_seconds = film->cpu_seconds();
  check.point.rays = film->rays();
  check.point.error = estimate.image(by.stop().confidence);
  check.bound = by.stop().relative_error ? by.error_bound(estimate) : 0;
  check.light_not_found = count_particles(due, by.stop().confidence);
  if (due.is_news) {
    note(check);
    sink.on_pass(check.point);
  }
  return check;
}

void RenderTask::Impl::note(ErrorCheck& check) {
  MutexLock lock(mutex);
  check.point.elapsed_seconds = clock.seconds();
  meter.note_check(check.point, check.bound);
  if (check.light_not_found) {
    light_not_found = check.light_not_found;
  }
}

void RenderTask::Impl::finish(StopReason why) {
  MutexLock lock(mutex);
  clock.stop();
  ending = why;
  phase = Phase::kOver;
}

RenderTask::RenderTask(std::shared_ptr<const Renderer> renderer, std::shared_ptr<Film> film,
                       TaskOptions options, RenderSink& sink)
    : impl_(
          std::make_unique<Impl>(std::move(renderer), std::move(film), std::move(options), sink)) {}

RenderTask::~RenderTask() = default;

std::optional<Slice> RenderTask::take(Process process) {
  Impl& m = *impl_;
  if (process == Process::kOther && !can_lend()) {
    return std::nullopt;
  }
  Impl::Due due;
  {
    MutexLock lock(m.mutex);
    if (m.paused || m.phase == Impl::Phase::kDeciding || m.phase == Impl::Phase::kOver) {
      return std::nullopt;
    }
    m.clock.start();
    m.note_clock();
    if (m.ending == StopReason::kNone) {
      if (const auto slice = m.find_slice(process)) {
        return slice;
      }
    }
    due = m.next_due();  // no slice was out: a restored complete film, or an expired clock
  }
  m.advance(std::move(due));
  return std::nullopt;
}

double RenderTask::seconds_to_hand_out() const {
  const Impl& m = *impl_;
  const double cpu_seconds = m.film->cpu_seconds();
  MutexLock lock(m.mutex);
  const bool is_pilot = m.phase == Impl::Phase::kPiloting;
  const int target =
      is_pilot ? m.pilot_target() : std::max(m.pass.target, m.policy.far_target(m.pass));
  double done = 0;
  double waiting = 0;
  for (const Impl::Tile& tile : m.tiles) {
    const int has = is_pilot ? tile.pilot_samples : tile.samples;
    done += tile.samples;
    waiting += tile.is_out ? 0 : std::max(0, target - has);
  }
  const double pixels = static_cast<double>(kTileSize) * kTileSize;
  return waiting * seconds_of_sample(pixels, static_cast<int>(std::min(done, 1e9)), cpu_seconds);
}

void RenderTask::cancel() {
  Impl& m = *impl_;
  Impl::Due due;
  {
    MutexLock lock(m.mutex);
    if (m.phase == Impl::Phase::kOver) {
      return;
    }
    m.ending = StopReason::kCancelled;
    m.stop_source.request_stop();
    due = m.next_due();
  }
  m.advance(std::move(due));
}

void RenderTask::set_paused(bool paused) {
  Impl& m = *impl_;
  MutexLock lock(m.mutex);
  if (paused && !m.paused) {
    m.clock.stop();
  }
  m.paused = paused;
}

void RenderTask::set_stop(const StopRules& stop) {
  Impl& m = *impl_;
  MutexLock lock(m.mutex);
  const bool had_clock = m.policy.has_clock();
  m.policy = PassPolicy(m.settings(), stop, m.samples_limit);
  m.meter.forget_fraction();
  if (m.phase == Impl::Phase::kPiloting) {  // the new rules may end the task here
    m.phase = Impl::Phase::kRendering;
  }
  if (!had_clock && m.policy.has_clock()) {  // the tiles of this pass were not kept
    const bool is_whole = std::all_of(m.tiles.begin(), m.tiles.end(),
                                      [&m](const Impl::Tile& t)
                                          REQUIRES(m.mutex) { return t.samples == m.pass.base; });
    m.pass.base_is_whole = m.in_flight == 0 && is_whole;
  }
}

bool RenderTask::finished() const {
  MutexLock lock(impl_->mutex);
  return impl_->phase == Impl::Phase::kOver;
}

StopReason RenderTask::stop_reason() const {
  MutexLock lock(impl_->mutex);
  return impl_->phase == Impl::Phase::kOver ? impl_->ending : StopReason::kNone;
}

std::vector<ConvergencePoint> RenderTask::points() const {
  MutexLock lock(impl_->mutex);
  return impl_->meter.points();
}

Progress RenderTask::progress() const {
  Impl& m = *impl_;
  Progress p;
  p.cpu_seconds = m.film->cpu_seconds();
  p.rays = m.film->rays();
  p.rejected_samples = m.film->rejected_samples();
  p.revision = m.film->revision();
  const SampleCounts counts = m.film->sample_counts();
  p.samples_min = static_cast<int>(counts.min);
  p.samples_max = static_cast<int>(counts.max);
  p.samples_mean = counts.mean;
  MutexLock lock(m.mutex);
  p.elapsed_seconds = m.clock.seconds();
  p.rays_per_second = p.elapsed_seconds > 0 ? static_cast<double>(p.rays) / p.elapsed_seconds : 0;
  double area = 0;
  double samples = 0;
  for (std::size_t t = 0; t < static_cast<std::size_t>(m.film->tile_count()); ++t) {
    const PixelRect r = m.film->tile_rect(static_cast<int>(t));
    const double pixels = static_cast<double>(r.width) * r.height;
    area += pixels;
    samples += pixels * m.tiles[t].samples;
  }
  p.light_not_found = m.light_not_found;
  const auto chunks = m.tiles.begin() + m.film->unit_count();
  p.has_meter_readings =
      chunks != m.tiles.end() &&
      std::all_of(chunks, m.tiles.end(), [](const Impl::Tile& chunk) { return chunk.samples > 0; });
  const bool is_over = m.phase == Impl::Phase::kOver;
  m.meter.tell(m.policy, samples / area, m.pass.base, is_over, p);
  if (is_over && m.ending != StopReason::kCancelled) {
    p.fraction = 1;
  }
  return p;
}

const Film& RenderTask::film() const noexcept { return *impl_->film; }
const Renderer& RenderTask::renderer() const noexcept { return *impl_->renderer; }

void run_to_end(RenderTask& task, int threads) {
  std::atomic<bool> has_failed = false;  // The slice of a failed thread never ends.
  parallel_for(threads)(threads, [&](int) {
    try {
      while (!has_failed && !task.finished()) {
        if (const auto slice = task.take()) {
          task.run(*slice);
        } else {
          std::this_thread::sleep_for(std::chrono::microseconds(100));
        }
      }
    } catch (...) {
      has_failed = true;
      throw;
    }
  });
}

}  // namespace core
