/// LifeCycle: takes a job from the queue through loading and rendering to its end, with pauses.
///
/// The scheduler's threads render, others load and save; no call here waits for a renderer, except
/// cancel() for some milliseconds.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include "server/jobs/background.h"
#include "server/jobs/checkpoints.h"
#include "server/jobs/film_library.h"
#include "server/jobs/job_book.h"
#include "server/jobs/journal.h"
#include "server/jobs/parking.h"
#include "server/jobs/run_builder.h"
#include "server/jobs/scheduler.h"
#include "server/jobs/verdict.h"

namespace server {

class LifeCycle final : private RenderRun::Owner {
 public:
  /// All members must outlive it.
  struct Parts {
    const DataDir& data;
    StorageQuota& quota;
    Log& log;
    Metrics& metrics;
    JobBook& book;
    Journal& journal;
    FilmLibrary& films;
    RunBuilder& builder;
    Scheduler& scheduler;
  };
  /// checkpoint_seconds: as of Checkpoints.
  LifeCycle(Parts parts, double checkpoint_seconds);

  /// Starts queued jobs as slots and memory allow. Call it whenever these change.
  void admit();
  /// While draining, queued jobs do not start.
  void set_draining(bool is_draining);
  bool is_draining() const { return draining_; }
  bool is_stopping() const { return stopping_; }
  /// Prevents further starts. Returns false when it was called before.
  bool begin_stop() { return !stopping_.exchange(true); }
  /// Stops all work and saves every film. Call after begin_stop().
  void finish_stop();

  /// Cancels the job; no effect on a finished one. Refused: the store cannot record it, and the job
  /// continues.
  Verdict cancel(const JobPointer& job);
  /// Acts on a change of the state. The job's change_mutex() must be held.
  void follow_state(const JobPointer& job, api::JobState before, const JobRecord& after);
  /// The same for a change of priority and stop rule.
  void follow_patch(const JobPointer& job, const JobRecord& before, const JobRecord& after);

  /// Renders the job from its beginning if its film has unverified samples of the worker, which
  /// returned wrong ones. A job that has ended is warned of and marked, since clients may have its
  /// image: it is rendered again when they ask.
  void distrust(const JobPointer& job, const std::string& worker);

  Checkpoints& checkpoints() { return checkpoints_; }
  /// Resumes jobs paused for lack of disk space if there is space now.
  void go_on_with_room();

  /// Returns the work done by all runs of this process.
  RenderRun::Work work_done() const;

 private:
  // Sequence of a job: admit() -> load() -> start() -> on_end() -> finish(). A cancelled job is
  // published as such at once, and save_cancelled() saves its film.
  void load(const std::shared_ptr<JobBook::Slot>& slot);
  void start(const JobPointer& job, const std::shared_ptr<RenderRun>& run, int generation);
  void on_first_slice(const RenderRun& run) override;
  void on_end(std::shared_ptr<RenderRun> run) override;
  /// Stores the end of the run.
  void end_run(const JobPointer& job, const std::shared_ptr<RenderRun>& run);
  void finish(const JobPointer& job, const std::shared_ptr<RenderRun>& run,
              core::StopReason reason);
  /// Handles an end that could not be stored: the job waits for disk space, or fails.
  void end_unstored(const JobPointer& job, const std::shared_ptr<RenderRun>& run,
                    const core::Error& error);
  void save_cancelled(const JobPointer& job, const std::shared_ptr<RenderRun>& run);
  /// run: null when there is none yet.
  void fail(const JobPointer& job, const std::shared_ptr<RenderRun>& run,
            const core::Error& failure);
  /// Takes the run of a finished job, if any, off the scheduler and releases its slot.
  void release(const JobPointer& job);
  void keep_film_of(Job& job, const RenderRun& run);

  /// Pauses the job on a full disk until go_on_with_room(). ended: the run whose end could not be
  /// stored, if any. Returns false when the job has ended otherwise; the caller then ends the
  /// run.
  bool pause_for_room(const JobPointer& job, const std::shared_ptr<RenderRun>& ended);
  void count_work(const RenderRun& run);

  const Parts parts_;
  Checkpoints checkpoints_;
  std::atomic<std::uint64_t> rays_done_ = 0;  ///< Rays of completed runs.
  std::atomic<std::uint64_t> samples_done_ = 0;
  std::atomic<bool> stopping_ = false;
  std::atomic<bool> draining_ = false;
  Parking parking_;
  Background loaders_;
  Background preview_loaders_;
  Background savers_;
};

}  // namespace server
