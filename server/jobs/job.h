/// Job: one job in memory, shared by the service, the streams that watch it, and its run.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>

#include "core/base/mutex.h"
#include "server/jobs/event_log.h"
#include "server/jobs/job_record.h"
#include "server/jobs/render_run.h"
#include "server/jobs/shared_texts.h"

namespace server {

/// A film that is not being rendered: of a finished job, or stored by the previous process.
struct StoredFilm {
  std::shared_ptr<const core::Film> film;
  FilmRecord record;
};

/// Position of the last `end` event, for clients that have seen it.
struct EndMark {
  std::int64_t stream = 0;
  std::uint64_t seq = 0;
};

class Job {
 public:
  /// Whether `log` holds all events since this run of the server began. It does not for a job that
  /// had ended before and was read from the store.
  enum class History { kInLog, kInStore };

  Job(JobRecord record, History history)
      : id_(record.view.id),
        tenant_(record.tenant),
        sequence_(record.sequence),
        memory_only_(is_memory_only(record.view.spec)),
        history_(history),
        record_(std::move(record)),
        spec_text_(text_of(record_)) {}

  const std::string& id() const { return id_; }
  /// The owner; empty: the operator.
  const std::string& tenant() const { return tenant_; }
  std::int64_t sequence() const { return sequence_; }
  bool memory_only() const { return memory_only_; }
  History history() const { return history_; }
  EventLog& log() const { return *log_; }
  std::shared_ptr<EventLog> shared_log() const { return log_; }
  SharedTexts& tile_texts() const { return tile_texts_; }

  /// spec_json() of the job. It rarely changes and is most of the text of a job.
  struct SpecText {
    std::uint32_t version = 0;  ///< JobView::spec_version
    std::shared_ptr<const std::string> text;
  };
  SpecText spec_text() const {
    const core::MutexLock lock(mutex_);
    return spec_text_;
  }

  JobRecord record() const {
    const core::MutexLock lock(mutex_);
    return record_;
  }
  api::JobState state() const {
    const core::MutexLock lock(mutex_);
    return record_.view.state;
  }
  /// True when the server paused it for lack of disk space and will resume it.
  bool waits_for_disk() const {
    const core::MutexLock lock(mutex_);
    return record_.view.pause_reason == api::PauseReason::kStorageFull;
  }
  std::shared_ptr<RenderRun> run() const {
    const core::MutexLock lock(mutex_);
    return run_;
  }
  /// Returns whether the job has ended and its film no longer changes: a job is published as
  /// cancelled before its last slices end.
  bool is_at_rest() const {
    const core::MutexLock lock(mutex_);
    return api::is_final(record_.view.state) && !run_;
  }
  std::shared_ptr<const StoredFilm> kept_film() const {
    const core::MutexLock lock(mutex_);
    return kept_film_;
  }
  /// Returns its newest denoised picture made since the server started.
  std::optional<api::DenoisedView> denoised() const {
    const core::MutexLock lock(mutex_);
    return denoised_;
  }
  /// Keeps the flicker of a video's image of the same film.
  void set_denoised(api::DenoisedView denoised) {
    const core::MutexLock lock(mutex_);
    if (!denoised.flicker && denoised_ && denoised_->revision == denoised.revision) {
      denoised.flicker = denoised_->flicker;
    }
    denoised_ = std::move(denoised);
  }
  /// Returns the exposure of exposure=auto for its last finished film, if that is known.
  std::optional<double> auto_exposure() const {
    const core::MutexLock lock(mutex_);
    return auto_exposure_;
  }
  void set_auto_exposure(double stops) {
    const core::MutexLock lock(mutex_);
    auto_exposure_ = stops;
  }
  /// Counts a denoised picture of the job as being made until the result is destroyed. Must not
  /// outlive the job.
  std::shared_ptr<void> note_denoising() {
    ++denoisings_;
    return {nullptr, [this](void*) { --denoisings_; }};
  }
  bool is_denoising() const { return denoisings_ > 0; }
  /// True if the job was deleted: it is no longer found, and its id may be reused once its film has
  /// been removed.
  bool is_removed() const { return is_removed_; }
  std::optional<EndMark> end_mark() const {
    const core::MutexLock lock(mutex_);
    return end_mark_;
  }

  void set_record(JobRecord record) {
    SpecText text = text_of(record);
    const core::MutexLock lock(mutex_);
    record_ = std::move(record);
    spec_text_ = std::move(text);
  }
  void set_run(std::shared_ptr<RenderRun> run) {
    const core::MutexLock lock(mutex_);
    run_.swap(run);
  }
  /// Detaches the run from the job and returns it.
  std::shared_ptr<RenderRun> take_run() {
    const core::MutexLock lock(mutex_);
    return std::exchange(run_, nullptr);
  }
  /// For memory-only jobs, which have no file to read it from.
  void keep_film(std::shared_ptr<const StoredFilm> film) {
    const core::MutexLock lock(mutex_);
    kept_film_.swap(film);
  }
  void set_end_mark(std::optional<EndMark> mark) {
    const core::MutexLock lock(mutex_);
    end_mark_ = mark;
  }

  /// With change_mutex() held.
  void set_removed(bool removed = true) { is_removed_ = removed; }

  /// Loading is slow, and the job may be paused and resumed in the meantime: only the latest load
  /// counts, and earlier ones are stopped. Call with change_mutex() held.
  struct Load {
    int generation = 0;
    std::stop_token stop;
  };
  Load begin_load() {
    std::stop_source next;
    Load load = {++load_generation_, next.get_token()};
    swap_load_stop(std::move(next)).request_stop();
    return load;
  }
  bool is_latest_load(int generation) const { return generation == load_generation_; }
  /// Ends a load that is under way.
  void stop_load() { swap_load_stop({}).request_stop(); }

  /// Serializes the changes of one job: held from reading the record until the change is committed
  /// and published. Locked before all other mutexes.
  core::Mutex& change_mutex() { return change_mutex_; }

 private:
  std::stop_source swap_load_stop(std::stop_source next) {
    const core::MutexLock lock(mutex_);
    return std::exchange(load_stop_, std::move(next));
  }
  static SpecText text_of(const JobRecord& record) {
    return {.version = record.view.spec_version,
            .text = std::make_shared<const std::string>(api::spec_json(record.view.spec))};
  }

  const std::string id_;
  const std::string tenant_;
  const std::int64_t sequence_;
  const bool memory_only_;
  const History history_;
  const std::shared_ptr<EventLog> log_ = std::make_shared<EventLog>();
  mutable SharedTexts tile_texts_;
  core::Mutex change_mutex_;
  std::atomic<int> load_generation_ = 0;
  std::atomic<bool> is_removed_ = false;
  std::atomic<int> denoisings_ = 0;  ///< Pictures being made.
  mutable core::Mutex mutex_;
  JobRecord record_ GUARDED_BY(mutex_);
  SpecText spec_text_ GUARDED_BY(mutex_);
  std::shared_ptr<RenderRun> run_ GUARDED_BY(mutex_);
  std::stop_source load_stop_ GUARDED_BY(mutex_);
  std::shared_ptr<const StoredFilm> kept_film_ GUARDED_BY(mutex_);
  std::optional<EndMark> end_mark_ GUARDED_BY(mutex_);
  std::optional<api::DenoisedView> denoised_ GUARDED_BY(mutex_);
  std::optional<double> auto_exposure_ GUARDED_BY(mutex_);
};

using JobPointer = std::shared_ptr<Job>;

}  // namespace server
