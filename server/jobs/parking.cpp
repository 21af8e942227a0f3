#include "server/jobs/parking.h"

#include <utility>

namespace server {

using api::JobState;
using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

using Clock = std::chrono::steady_clock;

SliceSource::Turn turn_of(const Job& job) {
  const auto run = job.run();  // Null while it loads.
  return run && !run->end() ? run->turn() : SliceSource::Turn{.has_image = false};
}

}  // namespace

Parking::Parking(Parts parts, double checkpoint_seconds, Follow follow, Parked on_parked)
    : parts_(parts),
      follow_(std::move(follow)),
      on_parked_(std::move(on_parked)),
      checkpoint_time_(checkpoint_seconds) {}

void Parking::make_room() {
  if (Clock::now() < leave_from_.load()) {
    return;
  }
  for (JobPointer& paused : parts_.book.take_parkable()) {
    parts_.savers.post([this, paused = std::move(paused)] { park(paused); });
  }
  if (JobPointer yielding = parts_.book.take_yielding(&turn_of)) {
    parts_.savers.post([this, yielding = std::move(yielding)] { yield_place(yielding); });
  }
}

void Parking::park(const JobPointer& job) {
  const auto run = job->run();
  if (const Status saved = run ? parts_.checkpoints.save_now(job) : core::ok_status(); !saved) {
    keep(job, saved.error());
    return;
  }
  detach(job, run, [&](const JobRecord& record) -> Verdict {
    if (record.view.state != JobState::kPaused || job->run() != run) {
      return Error{ErrorCode::kCancelled, "the job has resumed or ended", ""};
    }
    if (!run) {
      job->begin_load();  // Invalidates a load that is under way.
    }
    return {};
  });
}

void Parking::yield_place(const JobPointer& job) {
  const auto run = job->run();
  if (const Status saved = parts_.checkpoints.save_now(job); !saved) {
    keep(job, saved.error());
    return;
  }
  detach(job, run, [&](JobRecord& record) -> Verdict {
    if (record.view.state != JobState::kRendering || job->run() != run || run->end()) {
      return Error{ErrorCode::kCancelled, "the job was paused or has ended", ""};
    }
    record.view.state = JobState::kQueued;
    return {};
  });
}

void Parking::detach(const JobPointer& job, const std::shared_ptr<RenderRun>& run,
                     const Journal::Modify& modify) {
  JobState before = JobState::kPaused;
  const Verdict detached = parts_.journal.change(
      *job,
      [&](JobRecord& record) {
        before = record.view.state;
        return modify(record);
      },
      {.unstored = Journal::Unstored::kInMemory, .before_publishing = [&](const JobRecord& after) {
         job->set_run(nullptr);
         if (run) {
           parts_.scheduler.remove(*run);
           run->leave();
         }
         follow_(job, before, after);
       }});
  if (!detached) {
    parts_.book.keep(*job);
    return;
  }
  parts_.log.write(LogLevel::kInfo, "job_parked", {{"job", job->id()}});
  on_parked_(run.get());
}

void Parking::keep(const JobPointer& job, const Error& why) {
  parts_.book.keep(*job);
  if (why.code != ErrorCode::kCancelled) {
    leave_from_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(checkpoint_time_);
    parts_.log.write(LogLevel::kError, "film_not_saved",
                     {{"job", job->id()}, {"detail", why.message}});
  }
}

}  // namespace server
