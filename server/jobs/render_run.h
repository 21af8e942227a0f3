/// RenderRun: a rendering job: its task, its film, its film file.
///
/// A source of slices for the scheduler, and the sink of its own task. Ends exactly once, by the
/// task's decision or by a failure, and notifies its `Owner`.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/mutex.h"
#include "core/render/task/render_task.h"
#include "server/jobs/event_log.h"
#include "server/jobs/scheduler.h"
#include "server/store/film_file.h"

namespace server {

class Job;

/// Limits the local threads that render in addition to workers: with a queue, to --render-threads.
struct LocalThreads {
  int max = 0;
  std::atomic<int> busy = 0;
};

class RenderRun final : public SliceSource,
                        public std::enable_shared_from_this<RenderRun>,
                        private core::RenderSink {
 public:
  /// Called from render threads, or from the thread that cancels; must return quickly.
  class Owner {
   public:
    virtual ~Owner() = default;
    virtual void on_first_slice(const RenderRun& run) = 0;
    /// Called when run->end() is set.
    virtual void on_end(std::shared_ptr<RenderRun> run) = 0;
  };
  struct Contents {
    std::weak_ptr<Job> job;
    std::shared_ptr<void> slot;  ///< Released when the run is over.
    std::shared_ptr<const core::Renderer> renderer;
    std::shared_ptr<core::Film> film;
    std::optional<FilmFile> file;  ///< Empty: memory only.
    core::TaskOptions options;
    std::int64_t age = 0;  ///< As Turn::age.
    std::uint64_t scene_bytes = 0;
    std::string arithmetic = {};    ///< Recorded in the film file.
    LocalThreads* local = nullptr;  ///< Null without workers. Must outlive the run.
  };

  /// owner must outlive the run; log is shared with the job.
  RenderRun(Contents contents, std::shared_ptr<EventLog> log, Owner& owner);

  bool run_slice() override;
  Turn turn() const override;
  /// As RenderTask::set_stop(); Scheduler::set_rank() must follow.
  void set_stop(const core::StopRules& stop);

  /// Lends slices to a worker, of about that many CPU seconds in total; empty: none now. accept()
  /// or give_back() must follow for each.
  struct Lent {
    std::vector<core::Slice> slices;
    double expected_seconds = 0;
  };
  Lent lend(double seconds, std::size_t count_max);
  /// Returns whether workers render the run. Otherwise all threads of this process do.
  bool is_lent() const { return local_ != nullptr && task_.can_lend(); }
  /// Returns the inputs of the slice as of its lending.
  core::SliceWork prepare(const core::Slice& slice) const;
  void accept(std::vector<core::SliceWork> done);
  void give_back(const core::Slice& slice);

  /// Null: the job is gone.
  std::shared_ptr<Job> job() const { return job_.lock(); }
  /// Releases the slot before the run is destroyed, since readers may hold the run for a while.
  void leave();

  core::RenderTask& task() { return task_; }
  const core::RenderTask& task() const { return task_; }
  std::shared_ptr<const core::Film> film() const { return film_; }
  /// Returns the peak memory of the film and its scene.
  std::uint64_t peak_bytes() const;

  /// Work done by this run, without the contents of the film file that it resumed.
  struct Work {
    std::uint64_t rays = 0;
    std::uint64_t samples = 0;  ///< Over all pixels.
  };
  Work work() const;

  /// Writes the film file. Errors: kNoSpace, kInternal. No effect without a file.
  core::Status save(bool is_final);
  std::uint64_t file_bytes() const;
  /// Duration of the last save.
  double last_save_seconds() const { return last_save_seconds_.load(); }

  /// Ends the run for an external reason; no effect when it has ended.
  void fail(core::Error failure);

  struct End {
    core::StopReason reason = core::StopReason::kNone;
    std::optional<core::Error> failure = {};  ///< Empty unless reason is kFailed.
  };
  /// Empty while it runs.
  std::optional<End> end() const;
  /// Marks that the end could not be stored; the thread that takes it retries.
  void leave_end() { is_end_left_ = true; }
  bool take_end() { return is_end_left_.exchange(false); }
  bool has_left_end() const { return is_end_left_; }

 private:
  void on_tile(int tile, std::uint32_t revision) override;
  void on_pass(const core::ConvergencePoint& point) override;
  void on_finished(core::StopReason reason) override;
  void end_with(End end);
  void note_start();
  void note_shown();
  /// Calls it; an exception ends the run.
  template <typename Call>
  void guarded(Call&& call);

  const std::weak_ptr<Job> job_;
  const std::shared_ptr<core::Film> film_;
  const std::uint64_t scene_bytes_;
  const std::string arithmetic_;
  const std::shared_ptr<EventLog> log_;
  LocalThreads* const local_;
  Owner& owner_;
  const std::int64_t age_;
  std::atomic<bool> is_timed_;
  std::atomic<int> shown_tiles_ = 0;  ///< Tiles 0 to this one have samples.
  std::atomic<bool> started_ = false;
  mutable core::Mutex end_mutex_;
  std::optional<End> end_ GUARDED_BY(end_mutex_);
  std::atomic<bool> is_end_left_ = false;
  std::atomic<std::int64_t> progress_told_ms_ = 0;
  std::atomic<double> last_save_seconds_ = 0;
  core::Mutex slot_mutex_;
  std::shared_ptr<void> slot_ GUARDED_BY(slot_mutex_);
  mutable core::Mutex file_mutex_;  ///< Held while writing: one writer at a time.
  std::optional<FilmFile> file_ GUARDED_BY(file_mutex_);
  core::RenderTask task_;
  const Work before_;

  Work all_work() const;
};

}  // namespace server
