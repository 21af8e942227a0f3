#include "server/jobs/life_cycle.h"

#include <algorithm>
#include <new>
#include <utility>

#include "api/json/errors.h"
#include "core/film/splats.h"
#include "core/layers/exposure.h"
#include "core/render/task/render_task.h"
#include "server/observe/clock.h"
#include "server/store/files.h"
#include "server/store/film_file.h"

namespace server {

using api::JobState;
using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

/// Four tenants load two jobs each at the same time.
constexpr int kLoaders = 8;
constexpr int kLoadersOfTenant = 2;
constexpr int kSavers = 2;

Error already_final() {
  return Error{ErrorCode::kCancelled, "the job has ended in the meantime", ""};
}

}  // namespace

LifeCycle::LifeCycle(Parts parts, double checkpoint_seconds)
    : parts_(parts),
      checkpoints_({parts.quota, parts.log, parts.metrics, parts.book, parts.journal},
                   checkpoint_seconds,
                   // Only an ended job is not paused.
                   [this](const JobPointer& job) { pause_for_room(job, nullptr); }),
      parking_(
          {parts.log, parts.book, parts.journal, parts.scheduler, checkpoints_, savers_},
          checkpoint_seconds,
          [this](const JobPointer& job, JobState before, const JobRecord& after) {
            follow_state(job, before, after);
          },
          [this](const RenderRun* run) {
            if (run != nullptr) {
              count_work(*run);
            }
            admit();
          }),
      loaders_(kLoaders, kLoadersOfTenant, Background::Priority::kOfRendering),
      preview_loaders_(kLoaders / kLoadersOfTenant, 1, Background::Priority::kOfRendering),
      savers_(kSavers, kSavers, Background::Priority::kNormal) {}

void LifeCycle::set_draining(bool is_draining) {
  if (draining_.exchange(is_draining) != is_draining) {
    parts_.log.write(LogLevel::kWarning, is_draining ? "drain_begun" : "drain_ended", {});
  }
  admit();
}

void LifeCycle::finish_stop() {
  parts_.scheduler.stop();
  for (const JobPointer& job : parts_.book.holders()) {
    job->stop_load();
  }
  loaders_.stop(Background::Waiting::kDrop);
  preview_loaders_.stop(Background::Waiting::kDrop);
  savers_.stop(Background::Waiting::kFinish);
  for (const JobPointer& job : parts_.book.holders()) {
    const auto run = job->run();
    if (run && !api::is_final(job->state())) {
      static_cast<void>(checkpoints_.save_now(job));  // It continues from the last checkpoint.
    }
    if (run) {
      parts_.scheduler.remove(*run);
    }
    job->set_run(nullptr);  // A run holds its slot, and the slot holds the job.
  }
}

void LifeCycle::admit() {
  while (!stopping_ && !draining_) {
    std::shared_ptr<JobBook::Slot> slot = parts_.book.admit();
    if (!slot) {
      parking_.make_room();
      return;
    }
    Background& loaders = slot->job()->memory_only() ? preview_loaders_ : loaders_;
    const std::string tenant = slot->job()->tenant();
    loaders.post([this, slot = std::move(slot)] { load(slot); }, tenant);
  }
}

void LifeCycle::load(const std::shared_ptr<JobBook::Slot>& slot) {
  const JobPointer& job = slot->job();
  Job::Load load;
  const Verdict begun = parts_.journal.change(
      *job,
      [](JobRecord& record) -> Verdict {
        if (record.view.state != JobState::kQueued) {
          return already_final();  // Cancelled or paused before it started.
        }
        record.view.state = JobState::kLoading;
        return {};
      },
      {.unstored = Journal::Unstored::kInMemory,
       .before_publishing = [&](const JobRecord&) { load = job->begin_load(); }});
  if (!begun) {
    return;
  }
  if (stopping_) {  // finish_stop() may have looked before this load began.
    job->stop_load();
  }
  try {
    RenderRun::Owner& owner = *this;
    auto run = parts_.builder.build(slot, owner, load.stop);
    if (run) {
      start(job, *run, load.generation);
    } else if (run.error().code == ErrorCode::kCancelled) {
      // The job has ended or is loaded again; after a restart, if the server stops.
    } else if (run.error().code != ErrorCode::kNoSpace || !pause_for_room(job, nullptr)) {
      fail(job, nullptr, run.error());
    }
  } catch (const std::bad_alloc&) {
    fail(job, nullptr, Error{ErrorCode::kUnavailable, "not enough memory to load the job", ""});
  }
  parts_.films.remove_unused(*job);  // The job may have been cancelled while it was loading.
}

void LifeCycle::start(const JobPointer& job, const std::shared_ptr<RenderRun>& run,
                      int generation) {
  bool is_paused = false;
  // If the job has ended, was deleted or is being loaded again, the run and its slot are released.
  static_cast<void>(parts_.journal.change(
      *job,
      [&](JobRecord& record) -> Verdict {
        if (!job->is_latest_load(generation) || api::is_final(record.view.state)) {
          return already_final();
        }
        is_paused = record.view.state == JobState::kPaused;
        if (!is_paused) {
          record.view.state = JobState::kRendering;
        }
        if (!record.view.started_at_unix_seconds) {
          record.view.started_at_unix_seconds = unix_now();
        }
        record.view.progress = run->task().progress();
        record.view.peak_bytes = run->peak_bytes();
        record.view.split_count = run->task().renderer().measured_split_count();
        record.view.build = parts_.builder.build_text();
        return {};
      },
      {.unstored = Journal::Unstored::kInMemory, .before_publishing = [&](const JobRecord& record) {
         // A patch while the scene was loading had no run to apply the stop rules to.
         run->set_stop(record.view.spec.stop);
         job->set_run(run);
         if (is_paused) {
           run->task().set_paused(true);
         } else {
           parts_.scheduler.add(run, rank_of(record.view.spec), job->tenant());
         }
       }}));
}

void LifeCycle::on_first_slice(const RenderRun& run) {
  const bool is_resumed = run.task().progress().samples_max > 0;
  if (const auto job = is_resumed ? nullptr : run.job()) {
    parts_.metrics.count_queue_wait(unix_now() - job->record().view.created_at_unix_seconds);
  }
}

void LifeCycle::on_end(std::shared_ptr<RenderRun> run) {
  JobPointer job = run->job();
  savers_.post([this, job = std::move(job), run = std::move(run)] {
    // A parked job resumes from its file; parking may be under way.
    const auto is_parked = [&] {
      const core::MutexLock changing(job->change_mutex());
      return job->run() != run;
    };
    if (job && !is_parked()) {
      end_run(job, run);
    }
  });
}

void LifeCycle::end_run(const JobPointer& job, const std::shared_ptr<RenderRun>& run) {
  const RenderRun::End end = *run->end();
  if (end.failure) {
    fail(job, run, *end.failure);
  } else if (end.reason == core::StopReason::kCancelled) {
    save_cancelled(job, run);
  } else {
    finish(job, run, end.reason);
  }
}

void LifeCycle::finish(const JobPointer& job, const std::shared_ptr<RenderRun>& run,
                       core::StopReason reason) {
  parts_.scheduler.remove(*run);
  // Saves first, so that a job reported as finished still has its film after a power failure.
  if (const Status saved = checkpoints_.save(*run, *job, true); !saved) {
    end_unstored(job, run, saved.error());
    return;
  }
  const std::string digest = run->film()->digest();
  const core::Brightness brightness =
      core::brightness_of(*run->film(), job->record().view.spec.render.film);
  job->set_auto_exposure(brightness.auto_exposure);
  keep_film_of(*job, *run);
  const Verdict told = parts_.journal.change(
      *job,
      [&](JobRecord& record) -> Verdict {
        if (api::is_final(record.view.state)) {
          return already_final();
        }
        record.view.state = JobState::kFinished;
        record.view.pause_reason = api::PauseReason::kNone;
        record.view.stop_reason = reason;
        record.view.finished_at_unix_seconds = unix_now();
        record.view.progress = run->task().progress();
        record.view.peak_bytes = run->peak_bytes();
        note_samples_by_error(record.view);
        record.view.film_digest = digest;
        std::erase_if(record.view.warnings, [](const std::string& warning) {
          return warning.find(core::kClippedWords) != std::string::npos ||
                 warning.find(core::kRejectedWords) != std::string::npos;  // before an extension
        });
        if (const std::uint64_t rejected = record.view.progress.rejected_samples; rejected > 0) {
          record.view.warnings.push_back(core::rejected_warning(rejected));
        }
        if (brightness.is_clipped()) {
          record.view.warnings.push_back(core::clipped_warning(brightness, "exposure="));
        }
        record.film = job->memory_only() ? FilmPlace::kNone : FilmPlace::kOnDisk;
        record.film_bytes = run->file_bytes();
        return {};
      },
      {.unstored = Journal::Unstored::kRefused,
       .before_publishing = [&](const JobRecord&) { release(job); }});
  if (told) {
    parts_.films.evict();
  } else if (told.error() != nullptr) {
    end_unstored(job, run, *told.error());
  }
}

void LifeCycle::end_unstored(const JobPointer& job, const std::shared_ptr<RenderRun>& run,
                             const Error& error) {
  if (error.code == ErrorCode::kCancelled ||
      (error.code == ErrorCode::kNoSpace && !pause_for_room(job, run))) {
    save_cancelled(job, run);
  } else if (error.code != ErrorCode::kNoSpace) {
    fail(job, run, error);
  }
}

void LifeCycle::save_cancelled(const JobPointer& job, const std::shared_ptr<RenderRun>& run) {
  if (job->is_removed()) {
    release(job);
    return;
  }
  const Status saved = checkpoints_.save(*run, *job, true);
  if (!saved) {
    parts_.log.write(LogLevel::kError, "film_not_saved",
                     {{"job", job->id()}, {"detail", saved.error().message}});
  }
  if (run->task().progress().samples_max > 0) {
    keep_film_of(*job, *run);
  }
  const Verdict kept = parts_.journal.change(
      *job,
      [&](JobRecord& record) -> Verdict {
        const double fraction = record.view.progress.fraction;
        record.view.progress = run->task().progress();
        record.view.progress.fraction = fraction;
        if (!saved) {
          record.view.warnings.emplace_back(
              "The image at the time of cancellation could not be stored; that of the last "
              "checkpoint is kept.");
        }
        if (saved && !job->memory_only() && record.view.progress.samples_max > 0) {
          record.film = FilmPlace::kOnDisk;
          record.film_bytes = run->file_bytes();
        }
        return {};
      },
      {.unstored = Journal::Unstored::kInMemory,
       .before_publishing = [&](const JobRecord&) { release(job); }});
  if (!kept) {
    release(job);
  }
  parts_.films.remove_unused(*job);
}

void LifeCycle::fail(const JobPointer& job, const std::shared_ptr<RenderRun>& run,
                     const Error& failure) {
  const Verdict told = parts_.journal.change(
      *job,
      [&](JobRecord& record) -> Verdict {
        if (api::is_final(record.view.state)) {
          return already_final();
        }
        record.view.state = JobState::kFailed;
        record.view.pause_reason = api::PauseReason::kNone;
        record.view.stop_reason = core::StopReason::kFailed;
        record.view.finished_at_unix_seconds = unix_now();
        record.failure = failure;
        record.view.failure = api::from_error(failure);
        if (run) {
          record.view.progress = run->task().progress();
          record.view.progress.fraction = std::min(record.view.progress.fraction, 0.999);
        }
        return {};
      },
      {.unstored = Journal::Unstored::kRefusedIfFull,
       .before_publishing = [&](const JobRecord&) { release(job); }});
  if (!told && told.is(ErrorCode::kNoSpace) && pause_for_room(job, run)) {
    return;
  }
  if (!told) {
    release(job);
  }
  parts_.log.write(LogLevel::kWarning, "job_failed",
                   {{"job", job->id()}, {"detail", failure.message}});
  parts_.films.remove_unused(*job);
}

void LifeCycle::keep_film_of(Job& job, const RenderRun& run) {
  parts_.films.keep(job, run.film(),
                    {.elapsed_seconds = run.task().progress().elapsed_seconds,
                     .points = run.task().points(),
                     .arithmetic = parts_.builder.arithmetic()});
}

void LifeCycle::release(const JobPointer& job) {
  if (const auto run = job->take_run()) {
    parts_.scheduler.remove(*run);
    count_work(*run);
    run->leave();
  }
  parts_.book.retire(job);
}

Verdict LifeCycle::cancel(const JobPointer& job) {
  bool was_final = false;
  bool has_left_end = false;  // True if this thread has to end the run.
  const auto modify = [&](JobRecord& record) -> Verdict {
    was_final = api::is_final(record.view.state);
    if (!was_final) {
      record.view.state = JobState::kCancelled;
      record.view.pause_reason = api::PauseReason::kNone;
      record.view.stop_reason = core::StopReason::kCancelled;
      record.view.finished_at_unix_seconds = unix_now();
      if (const auto run = job->run()) {
        record.view.progress = run->task().progress();
        record.view.progress.eta_seconds.reset();
        record.view.progress.eta_low_seconds.reset();
        record.view.progress.eta_high_seconds.reset();
      }
    }
    return {};
  };
  const Verdict told =
      parts_.journal.change(*job, modify, {.before_publishing = [&](const JobRecord&) {
        if (was_final) {
          return;
        }
        parts_.book.dequeue(*job);
        job->stop_load();
        if (const auto run = job->run()) {
          parts_.scheduler.remove(*run);
          has_left_end = run->take_end();
        } else {
          release(job);
        }
      }});
  if (!told || was_final) {
    return told;
  }
  if (auto run = job->run()) {
    // The task may compute a last error estimate; the request does not wait for that.
    savers_.post([this, job, run = std::move(run), has_left_end] {
      if (has_left_end) {
        save_cancelled(job, run);
      } else {
        run->task().cancel();
      }
    });
  }
  admit();
  return {};
}

void LifeCycle::follow_state(const JobPointer& job, JobState before, const JobRecord& after) {
  if (before == after.view.state) {
    return;
  }
  const Rank rank = rank_of(after.view.spec);
  const auto run = job->run();
  if (after.view.state == JobState::kPaused) {
    parts_.book.dequeue(*job);
    if (run) {
      parts_.scheduler.remove(*run);
      run->task().set_paused(true);
    }
    parts_.book.pause(*job);
  } else if (after.view.state == JobState::kRendering) {
    parts_.book.claim(*job, rank);
    run->task().set_paused(false);
    parts_.scheduler.add(run, rank, job->tenant());
  } else if (after.view.state == JobState::kQueued) {
    parts_.book.enqueue(job, parts_.builder.admission_of(after.view.spec));
  }
}

void LifeCycle::follow_patch(const JobPointer& job, const JobRecord& before,
                             const JobRecord& after) {
  const api::JobSpec& spec = after.view.spec;
  const Rank rank = rank_of(spec);
  parts_.book.set_rank(*job, rank);
  const auto run = job->run();
  if (run && !api::is_final(after.view.state)) {
    run->set_stop(spec.stop);
  }
  if (run) {
    parts_.scheduler.set_rank(*run, rank);
  }
  follow_state(job, before.view.state, after);
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

void LifeCycle::distrust(const JobPointer& job, const std::string& worker) {
  JobState before = JobState::kQueued;
  std::shared_ptr<RenderRun> run;
  const auto modify = [&](JobRecord& record) -> Verdict {
    before = record.view.state;
    if (record.unverified.erase(worker) == 0) {
      return Error{ErrorCode::kCancelled, "the film has no unverified samples of the worker", ""};
    }
    if (api::is_final(before)) {
      doubt(record.view);
      return {};
    }
    if (const Status announced = parts_.films.announce_removal(*job); !announced) {
      parts_.log.write(LogLevel::kError, "film_not_removed",
                       {{"job", job->id()}, {"detail", announced.error().message}});
    }
    forget_samples(record);
    record.view.warnings.emplace_back(
        "A worker whose samples were in the film returned wrong results; the job is rendered "
        "again from its beginning.");
    record.view.state = before == JobState::kPaused ? before : JobState::kQueued;
    return {};
  };
  const auto restart = [&](const JobRecord& after) {
    parts_.log.write(LogLevel::kWarning, "job_doubted",
                     {{"job", job->id()}, {"worker", worker}, {"state", api::to_text(before)}});
    if (api::is_final(before)) {
      return;
    }
    job->stop_load();
    if ((run = job->take_run())) {
      parts_.scheduler.remove(*run);
      run->leave();
    }
    parts_.films.remove_forgotten(*job);
    follow_state(job, before, after);
  };
  const Verdict doubted = parts_.journal.change(
      *job, modify, {.unstored = Journal::Unstored::kInMemory, .before_publishing = restart});
  if (run) {
    count_work(*run);
  }
  if (doubted) {
    admit();
  }
}

void LifeCycle::count_work(const RenderRun& run) {
  const RenderRun::Work work = run.work();
  rays_done_ += work.rays;
  samples_done_ += work.samples;
}

RenderRun::Work LifeCycle::work_done() const {
  // In this order, a run that ends concurrently is briefly missed rather than counted twice.
  RenderRun::Work done{.rays = rays_done_, .samples = samples_done_};
  for (const JobPointer& job : parts_.book.with_slots()) {
    if (const auto run = job->run()) {
      const RenderRun::Work work = run->work();
      done.rays += work.rays;
      done.samples += work.samples;
    }
  }
  return done;
}

}  // namespace server
