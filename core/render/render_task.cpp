#include "core/render/render_task.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <thread>
#include <utility>

#include "core/render/allocation.h"
#include "core/render/render_task_impl.h"

namespace core {
namespace {

/// A job can end wrongly only where its error is above the target, by less than the bound is above the estimate. Between
/// looks errors fall by 6 to 13 %: before the last two or three of these looks the error is too far away, and what these see is
/// nearly the same.
constexpr int kLooksAtRisk = 2;
/// Passes that the pace is taken from.
constexpr std::size_t kPacePoints = 32;

/// What has to be at most the target for the job to end: the upper bound of what the picture is off by, or the largest
/// of its tiles'. alpha is shared by looks, and by tiles for worst_tile.
double error_bound(const ErrorEstimate& estimate, const Film& film, const StopRules& stop) {
  const double alpha = (1 - stop.confidence) / kLooksAtRisk;
  if (!stop.worst_tile) {
    return estimate.most(alpha);
  }
  const double alpha_tile = alpha / film.tile_count();
  double most = 0;
  for (int t = 0; t < film.tile_count(); ++t) {
    const double high = estimate.most(film.tile_rect(t), alpha_tile);
    if (std::isnan(high)) {
      return std::numeric_limits<double>::infinity();
    }
    most = std::max(most, high);
  }
  return most;
}

}  // namespace


RenderTask::RenderTask(std::shared_ptr<const Renderer> renderer, std::shared_ptr<Film> film,
                       TaskOptions options, RenderSink& sink)
    : impl_(std::make_unique<Impl>(std::move(renderer), std::move(film), std::move(options), sink)) {}

RenderTask::~RenderTask() = default;

std::optional<Slice> RenderTask::take() {
  Impl& m = *impl_;
  bool complete = false;
  {
    MutexLock lock(m.mutex);
    if (m.over || m.paused || m.cancelled || m.deciding) {
      return std::nullopt;
    }
    if (!m.running_since) {
      m.running_since = TaskClock::now();
    }
    m.note_clock();
    if (m.is_probing() && !m.expired) {
      if (m.probes_out == m.probes_due.size()) {
        return std::nullopt;
      }
      ++m.probes_out;
      ++m.in_flight;
      return Slice{.kind = SliceKind::kProbe};
    }
    if (!m.expired) {
      auto slice = m.find_slice();
      while (!slice && m.pass_target < m.barrier()) {
        m.pass_target = std::min(pass_end(m.pass_target, m.samples_max(), m.renderer->view().settings.replicates, m.unit()),
                                 m.barrier());
        slice = m.find_slice();
      }
      if (!slice && m.plan_is_due()) {
        slice = m.find_pilot_slice();
      }
      if (slice) {
        if (slice->kind == SliceKind::kPicture && m.edges_are_due()) {  // beside the picture, so that nobody waits for it
          m.edges_out = true;
          m.edges_last = true;
          ++m.in_flight;
          return Slice{.kind = SliceKind::kEdges};
        }
        m.edges_last = false;
        const auto t = static_cast<std::size_t>(slice->tile);
        m.busy[t] = 1;
        ++m.in_flight;
        return slice;
      }
    }
    complete = m.in_flight == 0;
  }
  if (complete) {  // nothing was out: a restored film that is whole, or a clock that ran out
    m.after_slice();
  }
  return std::nullopt;
}

void RenderTask::run(const Slice& slice) {
  Impl& m = *impl_;
  if (slice.kind == SliceKind::kEdges) {
    std::optional<EdgeDetail> wanted;
    {
      MutexLock lock(m.mutex);
      wanted = m.edges_wanted();
    }
    if (wanted) {
      m.search_edges(*wanted, m.options.slice_target_seconds, m.stop_source.get_token());
    }
    {
      MutexLock lock(m.mutex);
      m.edges_out = false;
      --m.in_flight;
      m.note_clock();
    }
    m.after_slice();
    return;
  }
  if (slice.kind == SliceKind::kProbe) {
    m.run_probe();
    m.after_slice();
    return;
  }
  const bool is_pilot = slice.kind == SliceKind::kPilot;
  const auto t = static_cast<std::size_t>(slice.tile);
  TileState state = m.film->tile(slice.tile);
  const double area = static_cast<double>(state.rect.width) * state.rect.height;
  const double per_sample = state.samples > 0 ? state.cpu_seconds / state.samples : area * 1.5e-6;
  const int step = std::max(1, static_cast<int>(m.options.slice_target_seconds / std::max(per_sample, 1e-9)));
  const int window = shared_window(m.renderer->view().settings);
  const int last = std::min(slice.last_sample, (slice.first_sample + step + window - 1) / window * window);
  {
    MutexLock lock(m.mutex);
    if (m.has_clock() && !is_pilot) {
      m.pass_base.try_emplace(slice.tile, state);
    }
  }
  const std::stop_token stop = m.stop_source.get_token();
  const bool whole = is_pilot ? m.renderer->render_pilot(state, last, stop) : m.renderer->render(state, last, stop);
  std::uint32_t revision = 0;
  if (whole && is_pilot) {
    m.film->keep(slice.tile, std::move(state));
  } else if (whole) {
    revision = m.film->commit(slice.tile, std::move(state));
  }
  {
    MutexLock lock(m.mutex);
    m.busy[t] = 0;
    if (whole) {
      (is_pilot ? m.piloted : m.done)[t] = last;
    }
  }
  if (whole && !is_pilot) {
    m.sink.on_tile(slice.tile, revision);
  }
  {
    MutexLock lock(m.mutex);
    --m.in_flight;
    m.note_clock();
  }
  m.after_slice();
}

/// Takes the decisions that are due when no slice is out.
void RenderTask::Impl::after_slice() {
  bool cancel_now = false;
  bool expire_now = false;
  bool plan_now = false;
  {
    MutexLock lock(mutex);
    if (over || deciding || in_flight > 0) {
      return;
    }
    cancel_now = cancelled;
    expire_now = expired && !cancelled;
    if ((cancel_now || expire_now) && reporting) {
      return;  // on_pass comes before on_finished: the report comes here again
    }
    if (!cancel_now && !expire_now && is_probing()) {
      if (probes_out < probes_due.size()) {
        return;
      }
      probes_due.clear();
    } else if (!cancel_now && !expire_now) {
      if (!pass_complete() || (pass_target < barrier())) {
        return;
      }
      plan_now = plan_is_due();
      if (plan_now && !pilot_complete()) {
        return;
      }
    }
    deciding = true;
  }
  if (cancel_now) {
    finish(StopReason::kCancelled);
    return;
  }
  if (expire_now) {
    std::map<int, TileState> base;
    StopReason why = StopReason::kSeconds;
    {
      MutexLock lock(mutex);
      why = expired_reason;
      if (!pass_complete()) {
        base.swap(pass_base);
      }
    }
    for (auto& [tile, state] : base) {  // back to the last complete pass
      const int samples = state.samples;
      const std::uint32_t revision = film->commit(tile, std::move(state));
      {
        MutexLock lock(mutex);
        done[static_cast<std::size_t>(tile)] = samples;
      }
      sink.on_tile(tile, revision);
    }
    finish(why);
    return;
  }
  if (plan_now) {
    begin_epoch();
  } else {
    decide();
  }
}

/// Makes the plan of the epoch that begins where every tile is.
void RenderTask::Impl::begin_epoch() {
  int from = 0;
  {
    MutexLock lock(mutex);
    from = planned_to;
  }
  const RenderSettings& settings = renderer->view().settings;
  const bool by_pilot = settings.adaptive.type == AdaptiveType::kPilot;
  film->install_plans({from, epoch_end(from)}, make_plans(*film, settings, from, by_pilot ? light_edges(EdgeDetail::kPlans) : LightEdges{}));
  {
    MutexLock lock(mutex);
    planned_to = epoch_end(from);
  }
  go_on();
}

/// After a decision that does not end the task.
void RenderTask::Impl::go_on() {
  bool again = false;
  {
    MutexLock lock(mutex);
    deciding = false;
    again = cancelled || expired;  // asked for meanwhile; nobody else may be there to act on it
  }
  if (again) {
    after_slice();
  }
}

void RenderTask::Impl::decide() {
  StopRules rules;
  int samples = 0;
  int most = 0;
  bool looks_now = false;
  {
    MutexLock lock(mutex);
    base_samples = pass_target;
    decided_at = base_samples;
    base_is_whole = true;
    if (pace.empty() || pace.back().samples < base_samples) {
      if (pace.size() >= kPacePoints) {
        pace.erase(pace.begin());
      }
      pace.push_back({elapsed_now(), static_cast<double>(base_samples)});
    }
    pass_base.clear();
    rules = stop;
    samples = base_samples;
    most = samples_max();
    const int due = rules.relative_error ? look_after(samples - 1) : next_report(samples - 1, renderer->view().settings.replicates, unit());
    looks_now = samples >= most || due == samples;
    looks_now = looks_now && samples != last_reported;
  }
  StopReason why = StopReason::kNone;
  if (samples >= most) {
    const bool asked = rules.samples_per_pixel &&
                       rounded_samples(renderer->view().settings, *rules.samples_per_pixel) <=
                           options.samples_limit;
    why = asked ? StopReason::kSamples : StopReason::kLimit;
  }
  const bool may_stop = rules.relative_error && samples >= std::min(kSamplesBeforeErrorStop, most);
  if (why == StopReason::kNone && !rules.relative_error && looks_now) {
    // Only a report: the other threads go on while this one computes it; and it is left out where it would take more than its share
    // of the work: of the processor's time, which other work beside does not stretch.
    const double cpu_now = film->cpu_seconds();
    {
      MutexLock lock(mutex);
      if (reporting || (cpu_now - look_ended) * options.report_share < look_cost) {
        looks_now = false;
      }
    }
  }
  if (why == StopReason::kNone && !rules.relative_error && looks_now) {
    {
      MutexLock lock(mutex);
      reporting = true;
    }
    const double cpu_start = thread_cpu_seconds();
    const FilmSnapshot snapshot = film->snapshot();
    {
      MutexLock lock(mutex);
      deciding = false;
      last_reported = samples;
    }
    const ErrorEstimate estimate = estimate_of(snapshot, samples, false, nullptr);
    const ConvergencePoint point = look(estimate, samples);
    {
      MutexLock lock(mutex);
      error = point.error;
      points.push_back(point);
      look_cost = thread_cpu_seconds() - cpu_start;
      look_ended = point.cpu_seconds;
    }
    sink.on_pass(point);
    {
      MutexLock lock(mutex);
      reporting = false;
    }
    after_slice();  // what had to wait for the report
    return;
  }
  if (why != StopReason::kNone || rules.relative_error) {
    MutexLock lock(mutex);
    if (reporting) {  // keeps the order of the points; the report comes here again
      deciding = false;
      decided_at = -1;
      return;
    }
  }
  if (looks_now) {
    std::vector<Probe> missing;
    const ErrorEstimate estimate = estimate_of(film->snapshot(), samples, why != StopReason::kNone, &missing);
    if (!missing.empty()) {  // all threads make them; then the decision is taken again
      {
        MutexLock lock(mutex);
        probes_due = std::move(missing);
        probes_out = probes_begun = 0;
      }
      go_on();
      return;
    }
    const ConvergencePoint point = look(estimate, samples);
    double bound = 0;
    if (rules.relative_error && estimate.valid()) {
      bound = error_bound(estimate, *film, rules);
      // Whoever reads the error of such a job finds it met.
      if (may_stop && std::max(bound, point.error.relative_rmse) <= *rules.relative_error) {
        why = StopReason::kRelativeError;
      }
    }
    {
      MutexLock lock(mutex);
      stop_bound = bound;
      error = point.error;
      points.push_back(point);
      last_reported = samples;
    }
    sink.on_pass(point);
  }
  if (why != StopReason::kNone) {
    finish(why);
    return;
  }
  go_on();
}

void RenderTask::Impl::finish(StopReason why) {
  // A job that its clock ended has an error estimate too. Who cancels does not want to wait for
  // one: the last look stands, which errs on the safe side.
  if (why != StopReason::kFailed && why != StopReason::kCancelled) {
    int samples = 0;
    bool fresh = false;
    {
      MutexLock lock(mutex);
      samples = *std::min_element(done.begin(), done.end());
      fresh = samples == last_reported;
    }
    if (!fresh && samples > 0) {
      const ErrorEstimate estimate = estimate_of(film->snapshot(), samples, false, nullptr);
      const ConvergencePoint point = look(estimate, samples);
      {
        MutexLock lock(mutex);
        error = point.error;
        points.push_back(point);
        last_reported = samples;
      }
      sink.on_pass(point);
    }
  }
  {
    MutexLock lock(mutex);
    elapsed = elapsed_now();
    running_since.reset();
    reason = why;
    over = true;
    deciding = false;
  }
  sink.on_finished(why);
}

void RenderTask::cancel() {
  Impl& m = *impl_;
  {
    MutexLock lock(m.mutex);
    if (m.over || m.cancelled) {
      return;
    }
    m.cancelled = true;
  }
  m.stop_source.request_stop();
  m.cancel_source.request_stop();
  m.after_slice();
}

void RenderTask::set_paused(bool paused) {
  Impl& m = *impl_;
  MutexLock lock(m.mutex);
  if (paused && !m.paused) {
    m.elapsed = m.elapsed_now();
    m.running_since.reset();
  }
  m.paused = paused;
}

void RenderTask::set_stop(const StopRules& stop) {
  Impl& m = *impl_;
  MutexLock lock(m.mutex);
  const bool had_clock = m.has_clock();
  m.stop = stop;
  m.fraction_told = 0;
  m.decided_at = -1;
  if (!had_clock && m.has_clock()) {  // the tiles of this pass were not kept
    m.base_is_whole = m.in_flight == 0 && std::all_of(m.done.begin(), m.done.end(), [&m](int n) REQUIRES(m.mutex) {
                        return n == m.base_samples;
                      });
  }
}

bool RenderTask::finished() const {
  MutexLock lock(impl_->mutex);
  return impl_->over;
}

StopReason RenderTask::stop_reason() const {
  MutexLock lock(impl_->mutex);
  return impl_->reason;
}

std::vector<ConvergencePoint> RenderTask::points() const {
  MutexLock lock(impl_->mutex);
  return impl_->points;
}

const Film& RenderTask::film() const noexcept { return *impl_->film; }
const Renderer& RenderTask::renderer() const noexcept { return *impl_->renderer; }

void run_to_end(RenderTask& task, int threads) {
  std::vector<std::jthread> pool;
  for (int i = 0; i < threads; ++i) {
    pool.emplace_back([&task] {
      while (!task.finished()) {
        if (const auto slice = task.take()) {
          task.run(*slice);
        } else {
          std::this_thread::sleep_for(std::chrono::microseconds(100));
        }
      }
    });
  }
}

}  // namespace core
