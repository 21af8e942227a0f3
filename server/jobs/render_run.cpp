#include "server/jobs/render_run.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <limits>
#include <new>
#include <utility>

#include "core/render/units/slice_work.h"

namespace server {
namespace {

/// The API limits progress events to two per second.
constexpr std::int64_t kProgressEveryMs = 500;

std::int64_t steady_ms() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// Returns whether the job's time runs out while other jobs are served.
bool is_timed(const core::StopRules& stop) {
  return stop.seconds.has_value() || stop.deadline_unix_seconds.has_value();
}

}  // namespace

RenderRun::RenderRun(Contents contents, std::shared_ptr<EventLog> log, Owner& owner)
    : job_(std::move(contents.job)),
      film_(contents.film),
      scene_bytes_(contents.scene_bytes),
      arithmetic_(std::move(contents.arithmetic)),
      log_(std::move(log)),
      local_(contents.local),
      owner_(owner),
      age_(contents.age),
      is_timed_(is_timed(contents.options.stop)),
      slot_(std::move(contents.slot)),
      file_(std::move(contents.file)),
      task_(std::move(contents.renderer), std::move(contents.film), std::move(contents.options),
            *this),
      before_(all_work()) {
  note_shown();  // of a resumed film
}

SliceSource::Turn RenderRun::turn() const {
  return {.age = age_, .has_image = shown_tiles_ >= film_->tile_count(), .is_timed = is_timed_};
}

void RenderRun::set_stop(const core::StopRules& stop) {
  is_timed_ = is_timed(stop);
  task_.set_stop(stop);
}

void RenderRun::note_shown() {
  int tile = shown_tiles_;
  while (tile < film_->tile_count() && film_->tile_samples(tile) > 0) {
    ++tile;
  }
  shown_tiles_ = tile;  // Another thread may store less; the next slice corrects it.
}

RenderRun::Work RenderRun::all_work() const {
  const core::Progress progress = task_.progress();
  const core::PixelRect crop = film_->crop();
  const double pixels = static_cast<double>(crop.width) * static_cast<double>(crop.height);
  return {.rays = progress.rays,
          .samples = static_cast<std::uint64_t>(progress.samples_mean * pixels)};
}

RenderRun::Work RenderRun::work() const {
  const Work now = all_work();
  return {.rays = now.rays - std::min(now.rays, before_.rays),
          .samples = now.samples - std::min(now.samples, before_.samples)};
}

template <typename Call>
void RenderRun::guarded(Call&& call) {
  try {
    call();
  } catch (const std::bad_alloc&) {
    fail(core::Error{core::ErrorCode::kUnavailable, "not enough memory to continue rendering", ""});
  } catch (const std::exception& error) {
    fail(core::Error{core::ErrorCode::kInternal, error.what(), ""});
  }
}

void RenderRun::note_start() {
  if (!started_.exchange(true)) {
    owner_.on_first_slice(*this);
  }
}

bool RenderRun::run_slice() {
  // All local threads render jobs that workers do not.
  const bool is_shared = is_lent();
  if (is_shared && local_->busy.fetch_add(1) >= local_->max) {
    --local_->busy;
    return false;
  }
  bool ran = true;
  guarded([&] {
    const auto slice = task_.take();
    ran = slice.has_value();
    if (slice) {
      note_start();
      task_.run(*slice);
      note_shown();
    }
  });
  if (is_shared) {
    --local_->busy;
  }
  return ran;
}

RenderRun::Lent RenderRun::lend(double seconds, std::size_t count_max) {
  Lent lent;
  if (!is_lent()) {
    return lent;
  }
  guarded([&] {
    while (lent.expected_seconds < seconds && lent.slices.size() < count_max) {
      const auto slice = task_.take(core::RenderTask::Process::kOther);
      if (!slice) {
        return;
      }
      note_start();
      const core::SliceWork work = task_.prepare(*slice, seconds);
      lent.slices.push_back(work.slice);
      lent.expected_seconds += work.expected_seconds;
    }
  });
  return lent;
}

core::SliceWork RenderRun::prepare(const core::Slice& slice) const {
  return task_.prepare(slice, std::numeric_limits<double>::infinity());
}

void RenderRun::accept(std::vector<core::SliceWork> done) {
  guarded([&] {
    task_.accept(std::move(done));
    note_shown();
  });
}

void RenderRun::give_back(const core::Slice& slice) {
  guarded([&] { task_.give_back(slice); });
}

void RenderRun::leave() {
  std::shared_ptr<void> slot;
  const core::MutexLock lock(slot_mutex_);
  slot.swap(slot_);
}

std::uint64_t RenderRun::peak_bytes() const { return scene_bytes_ + film_->bytes(); }

core::Status RenderRun::save(bool is_final) {
  const core::MutexLock lock(file_mutex_);
  if (!file_) {
    return core::ok_status();
  }
  const auto begin = std::chrono::steady_clock::now();
  const FilmRecord record{.elapsed_seconds = task_.progress().elapsed_seconds,
                          .points = task_.points(),
                          .arithmetic = arithmetic_};
  auto status = file_->write(*film_, record, is_final);
  last_save_seconds_ =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return status;
}

std::uint64_t RenderRun::file_bytes() const {
  const core::MutexLock lock(file_mutex_);
  return file_ ? file_->disk_bytes() : 0;
}

void RenderRun::fail(core::Error failure) {
  end_with({.reason = core::StopReason::kFailed, .failure = std::move(failure)});
}

void RenderRun::on_tile(int tile, std::uint32_t revision) {
  log_->tile_changed(tile, revision);
  const std::int64_t now = steady_ms();
  std::int64_t told = progress_told_ms_.load();
  if (now - told >= kProgressEveryMs && progress_told_ms_.compare_exchange_strong(told, now)) {
    log_->progress_changed();
  }
}

void RenderRun::on_pass(const core::ConvergencePoint&) { log_->progress_changed(); }

void RenderRun::on_finished(core::StopReason reason) { end_with({.reason = reason}); }

std::optional<RenderRun::End> RenderRun::end() const {
  const core::MutexLock lock(end_mutex_);
  return end_;
}

void RenderRun::end_with(End end) {
  {
    const core::MutexLock lock(end_mutex_);
    if (end_) {
      return;
    }
    end_ = std::move(end);
  }
  owner_.on_end(shared_from_this());
}

}  // namespace server
