/// LifeCycle: a job from the queue through loading and rendering to its end, with pauses, parking
/// and checkpoints on the way.
///
/// Rendering happens on the scheduler's threads, loading and saving on others; no call here waits
/// for a renderer, except cancel() for some milliseconds.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "server/jobs/background.h"
#include "server/jobs/film_library.h"
#include "server/jobs/job_book.h"
#include "server/jobs/journal.h"
#include "server/jobs/run_builder.h"
#include "server/jobs/scheduler.h"
#include "server/jobs/verdict.h"

namespace server {

class LifeCycle final : private RenderRun::Owner {
 public:
  /// All outlive it.
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
  /// checkpoint_seconds: a checkpoint is complete this long after the one before. build: JSON text
  /// that goes with films made here.
  LifeCycle(Parts parts, double checkpoint_seconds, std::string build);

  /// Begins what waits, as far as there are places and memory. To be called whenever that changes.
  void admit();
  /// None of the queue begins while the server drains.
  void set_draining(bool is_draining);
  bool is_draining() const { return draining_; }
  bool is_stopping() const { return stopping_; }
  /// Nothing begins any more. False: that was said before.
  bool begin_stop() { return !stopping_.exchange(true); }
  /// Ends all work, with every film on the disk as far as it is. After begin_stop().
  void finish_stop();

  /// Cancels the job; one that has ended is left as it is. Refused: the store cannot take it, and
  /// the job goes on.
  Verdict cancel(const JobPointer& job);
  /// What follows from a change of the state. The job's change_mutex() is held.
  void follow_state(const JobPointer& job, api::JobState before, const JobRecord& after);
  /// The same for a change of priority and stop rule.
  void follow_patch(const JobPointer& job, const JobRecord& before, const JobRecord& after);

  /// Saves the films that are due.
  void save_due(const std::stop_token& stop);
  /// Jobs that wait for room on the disk go on if there is some.
  void go_on_with_room();

  /// What all runs of this process have done.
  RenderRun::Work work_done() const;

 private:
  // The way of a job: admit() -> load() -> start() -> on_end() -> finish(). A cancelled job is
  // published as such at once, and settle_cancelled() keeps its film.
  void load(const std::shared_ptr<JobBook::Place>& place);
  void start(const JobPointer& job, const std::shared_ptr<RenderRun>& run, int generation);
  void on_first_slice(const RenderRun& run) override;
  void on_end(std::shared_ptr<RenderRun> run) override;
  /// Stores the end of the run.
  void settle(const JobPointer& job, const std::shared_ptr<RenderRun>& run);
  void finish(const JobPointer& job, const std::shared_ptr<RenderRun>& run,
              core::StopReason reason);
  /// The end of the run could not be stored: the job waits for room, or ends as it can.
  void end_unstored(const JobPointer& job, const std::shared_ptr<RenderRun>& run,
                    const core::Error& error);
  void settle_cancelled(const JobPointer& job, const std::shared_ptr<RenderRun>& run);
  /// run: null when there is none yet.
  void fail(const JobPointer& job, const std::shared_ptr<RenderRun>& run,
            const core::Error& failure);
  /// The job has ended: its run, if any, gets no slices any more and gives its place back.
  void release(const JobPointer& job);
  void keep_film_of(Job& job, const RenderRun& run);

  /// Gives the memory of a paused job back; it goes on from its film file.
  void park(const JobPointer& job);
  /// The disk is full: the job stands still until go_on_with_room(). ended: the run whose end could
  /// not be stored, if there is one. False: the job has ended otherwise, and the caller settles
  /// the run.
  bool pause_for_room(const JobPointer& job, const std::shared_ptr<RenderRun>& ended);
  void checkpoint(const JobPointer& job);
  /// Leaves the reserve of a full disk to the records. Errors: kNoSpace, kInternal.
  core::Status save(RenderRun& run, const Job& job, bool is_final) const;
  void count_work(const RenderRun& run);

  const Parts parts_;
  const double checkpoint_seconds_;
  const std::string build_;
  std::atomic<std::uint64_t> rays_done_ = 0;  ///< Of runs that are over.
  std::atomic<std::uint64_t> samples_done_ = 0;
  std::atomic<bool> stopping_ = false;
  std::atomic<bool> draining_ = false;
  /// When a job was last saved; of the thread that calls save_due() alone.
  std::map<std::string, std::chrono::steady_clock::time_point> saved_at_;
  Background loaders_;
  Background preview_loaders_;
  Background savers_;
};

}  // namespace server
