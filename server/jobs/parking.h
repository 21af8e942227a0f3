/// Parking: makes room for the next job of the queue. Paused jobs, and running ones that come after
/// it, leave memory and slot once their films are saved; they resume from their files.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>

#include "server/jobs/background.h"
#include "server/jobs/checkpoints.h"
#include "server/jobs/job_book.h"
#include "server/jobs/journal.h"
#include "server/jobs/scheduler.h"

namespace server {

class Parking {
 public:
  /// All members must outlive the work in `savers`.
  struct Parts {
    Log& log;
    JobBook& book;
    Journal& journal;
    Scheduler& scheduler;
    Checkpoints& checkpoints;
    Background& savers;
  };
  /// Acts on a change of the state; the job's change_mutex() is held.
  using Follow =
      std::function<void(const JobPointer& job, api::JobState before, const JobRecord& after)>;
  /// Called when a job has left. run: null if it was loading.
  using Parked = std::function<void(const RenderRun* run)>;
  /// checkpoint_seconds: as of Checkpoints.
  Parking(Parts parts, double checkpoint_seconds, Follow follow, Parked on_parked);

  /// Begins to make room in the background, if any job can.
  void make_room();

 private:
  /// Releases the memory of a paused job.
  void park(const JobPointer& job);
  /// Puts a rendering job back into the queue.
  void yield_place(const JobPointer& job);
  /// Takes the run, null while it loads, off a job whose film is saved, if modify allows it.
  void detach(const JobPointer& job, const std::shared_ptr<RenderRun>& run,
              const Journal::Modify& modify);
  /// The job keeps its memory and place. why: its film could not be saved, unless kCancelled.
  void keep(const JobPointer& job, const core::Error& why);

  const Parts parts_;
  const Follow follow_;
  const Parked on_parked_;
  const std::chrono::duration<double> checkpoint_time_;
  /// No job leaves before this time: a film could not be saved.
  std::atomic<std::chrono::steady_clock::time_point> leave_from_ = {};
};

}  // namespace server
