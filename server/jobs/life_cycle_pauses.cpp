// Pauses, parking and checkpoints of unfinished jobs.

#include <algorithm>
#include <chrono>

#include "server/jobs/life_cycle.h"
#include "server/store/files.h"
#include "server/store/film_file.h"

namespace server {

using api::JobState;
using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

using Clock = std::chrono::steady_clock;

/// The time between two checkpoints is at least this multiple of the time to write one.
constexpr double kWriteShare = 20;
/// Fraction of the interval after which writing begins, so that it completes within the interval.
constexpr double kBegin = 0.8;

Error already_final() {
  return Error{ErrorCode::kCancelled, "the job has ended in the meantime", ""};
}

}  // namespace

Status LifeCycle::save(RenderRun& run, const Job& job, bool is_final) const {
  if (!job.memory_only() && !parts_.quota.has_disk_room()) {
    return Error{ErrorCode::kNoSpace, "the disk is full", ""};
  }
  return run.save(is_final);
}

bool LifeCycle::pause_for_room(const JobPointer& job, const std::shared_ptr<RenderRun>& ended) {
  if (ended) {
    ended->leave_end();
  }
  if (job->state() == JobState::kPaused) {
    return true;
  }
  JobState before = JobState::kPaused;
  const Verdict paused = parts_.journal.change(
      *job,
      [&](JobRecord& record) -> Verdict {
        before = record.view.state;
        if (api::is_final(before)) {
          return already_final();
        }
        if (before != JobState::kPaused) {
          record.view.state = JobState::kPaused;
          record.view.pause_reason = api::PauseReason::kStorageFull;
        }
        if (const auto run = job->run()) {
          record.view.progress = run->task().progress();
        }
        return {};
      },
      {.unstored = Journal::Unstored::kInMemory,
       .before_publishing = [&](const JobRecord& after) { follow_state(job, before, after); }});
  // A concurrent cancel() may have taken the end of the run.
  return paused || (ended && !ended->take_end());
}

void LifeCycle::go_on_with_room() {
  if (!parts_.quota.has_disk_room()) {
    return;
  }
  const auto has_room = [this](const RenderRun& run) {
    const auto space = disk_space(parts_.data.path());
    return !space || space->free_bytes + run.file_bytes() >= FilmFile::disk_bytes_max(*run.film());
  };
  for (const JobPointer& job : parts_.book.all()) {
    if (!job->waits_for_disk()) {
      continue;
    }
    const auto run = job->run();
    if (run && !has_room(*run)) {
      continue;
    }
    if (run && run->take_end()) {
      end_run(job, run);
      continue;
    }
    if (run ? !run->save(false) : !parts_.films.open_film_file(*job)) {
      continue;
    }
    // Otherwise the job was cancelled or paused in the meantime.
    static_cast<void>(parts_.journal.change(
        *job,
        [&](JobRecord& record) -> Verdict {
          if (record.view.pause_reason != api::PauseReason::kStorageFull || job->run() != run) {
            return already_final();
          }
          record.view.state = run ? JobState::kRendering : JobState::kQueued;
          record.view.pause_reason = api::PauseReason::kNone;
          return {};
        },
        {.before_publishing = [&](const JobRecord& after) {
          follow_state(job, JobState::kPaused, after);
        }}));
  }
  admit();
}

void LifeCycle::begin_again(const JobPointer& job) {
  savers_.post([this, job] {
    JobState before = JobState::kQueued;
    std::shared_ptr<RenderRun> run;
    const auto modify = [&](JobRecord& record) -> Verdict {
      before = record.view.state;
      if (api::is_final(before)) {
        record.view.warnings.emplace_back(
            "A worker that rendered parts of the image without a check by a second one returned "
            "wrong results later. Render the job again.");
        return {};
      }
      record.view.warnings.emplace_back(
          "A worker whose samples were in the film returned wrong results; the job is rendered "
          "again from its beginning.");
      const std::uint32_t revision = record.view.progress.revision;
      record.view.progress = api::JobView::nothing_rendered();
      record.view.progress.revision = revision;
      record.view.state = before == JobState::kPaused ? before : JobState::kQueued;
      record.film = FilmPlace::kNone;
      record.film_bytes = 0;
      return {};
    };
    const auto restart = [&](const JobRecord& after) {
      if (api::is_final(before)) {
        return;
      }
      job->stop_load();
      if ((run = job->take_run())) {
        parts_.scheduler.remove(*run);
        run->leave();
      }
      parts_.films.drop(*job);
      if (const Status removed = remove_file(parts_.data.film_path(job->id())); !removed) {
        parts_.log.write(LogLevel::kError, "film_not_removed",
                         {{"job", job->id()}, {"detail", removed.error().message}});
      }
      follow_state(job, before, after);
    };
    static_cast<void>(parts_.journal.change(
        *job, modify, {.unstored = Journal::Unstored::kInMemory, .before_publishing = restart}));
    if (run) {
      count_work(*run);
    }
    admit();
  });
}

void LifeCycle::park(const JobPointer& job) {
  const auto run = job->run();
  if (run) {
    if (const Status saved = save(*run, *job, false); !saved) {
      parts_.log.write(LogLevel::kError, "film_not_saved",
                       {{"job", job->id()}, {"detail", saved.error().message}});
      parts_.book.keep(*job);  // Parking is retried when the next job asks for memory.
      return;
    }
  }
  const Verdict parked = parts_.journal.change(
      *job,
      [&](JobRecord& record) -> Verdict {
        if (record.view.state != JobState::kPaused || job->run() != run) {
          return Error{ErrorCode::kCancelled, "the job has resumed or ended", ""};
        }
        if (run) {
          record.view.progress = run->task().progress();
        } else {
          job->begin_load();  // Invalidates a load that is under way.
        }
        return {};
      },
      {.unstored = Journal::Unstored::kInMemory, .before_publishing = [&](const JobRecord&) {
         job->set_run(nullptr);
         if (run) {
           run->leave();
         }
       }});
  if (!parked) {
    return;
  }
  if (run) {
    count_work(*run);
  }
  parts_.log.write(LogLevel::kInfo, "job_parked", {{"job", job->id()}});
}

void LifeCycle::checkpoint(const JobPointer& job) {
  const auto run = job->run();
  if (!run || job->memory_only() || run->task().finished()) {
    return;  // The thread that ended the run saves its film.
  }
  if (const Status saved = save(*run, *job, false); !saved) {
    parts_.metrics.count(Counter::kCheckpointFailed);
    if (saved.error().code != ErrorCode::kNoSpace) {
      run->fail(saved.error());
    } else if (!job->waits_for_disk()) {
      static_cast<void>(pause_for_room(job, nullptr));  // Only an ended job fails.
    }
    return;
  }
  const auto modify = [&](JobRecord& record) -> Verdict {
    if (api::is_final(record.view.state)) {
      return Error{ErrorCode::kCancelled, "", ""};
    }
    record.view.progress = run->task().progress();
    record.film = FilmPlace::kOnDisk;
    record.film_bytes = run->file_bytes();
    return {};
  };
  const Verdict noted =
      parts_.journal.change(*job, modify, {.unstored = Journal::Unstored::kInMemory});
  if (noted) {
    parts_.metrics.count(Counter::kCheckpointWritten);
    parts_.log.write(LogLevel::kDebug, "checkpoint",
                     {{"job", job->id()}, {"seconds", run->last_save_seconds()}});
  }
}

void LifeCycle::save_due(const std::stop_token& stop) {
  for (const JobPointer& job : parts_.book.all()) {
    const auto run = job->run();
    if (stop.stop_requested() || !run || job->memory_only()) {
      continue;
    }
    const double interval =
        std::max(checkpoint_seconds_ * kBegin, run->last_save_seconds() * kWriteShare);
    const auto now = Clock::now();
    const auto [last, is_new] = saved_at_.emplace(job->id(), now);
    if (is_new || std::chrono::duration<double>(now - last->second).count() < interval) {
      continue;
    }
    checkpoint(job);
    last->second = Clock::now();
  }
  std::erase_if(saved_at_, [this](const auto& entry) {
    const auto job = parts_.book.find(entry.first);
    return !job || !job->run();
  });
}

}  // namespace server
