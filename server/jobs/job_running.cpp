// The way of a job from the queue through loading and rendering to its end.

#include <new>
#include <utility>

#include <unistd.h>

#include "api/errors.h"
#include "core/render/render_task.h"
#include "core/settings/registry.h"
#include "server/jobs/job_service.h"
#include "server/jobs/save_run.h"
#include "server/observe/clock.h"

namespace server {

using api::JobState;
using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

/// A restart may take a film back to its last checkpoint. No revision is given twice: a client that
/// has seen the ones in between would miss tiles. More than this are not made between checkpoints.
constexpr std::uint32_t kRevisionGap = 1U << 16U;
constexpr int kLoadTries = 3;

Error already_final() { return Error{ErrorCode::kCancelled, "the job has ended meanwhile", ""}; }

}  // namespace

core::Progress JobService::progress_of(const RenderRun& run) { return run.task().progress(); }

void JobService::admit() {
  while (!stopping_ && !draining_) {
    std::shared_ptr<JobBook::Place> place = book_.admit();
    if (!place) {
      for (JobPointer& paused : book_.take_parkable()) {
        savers_.post([this, paused = std::move(paused)] { park(paused); });
      }
      return;
    }
    Background& loaders = place->job()->memory_only() ? preview_loaders_ : loaders_;
    loaders.post([this, place = std::move(place)] { load(place); });
  }
}

void JobService::load(const std::shared_ptr<JobBook::Place>& place) {
  const JobPointer& job = place->job();
  int generation = 0;
  const Status begun =
      change(*job,
             [](JobRecord& record) -> Status {
               if (record.view.state != JobState::kQueued) {
                 return already_final();  // Cancelled or paused before its turn.
               }
               record.view.state = JobState::kLoading;
               return core::ok_status();
             },
             {.unstored = Unstored::kInMemory,
              .before_telling = [&](const JobRecord&) { generation = job->begin_load(); }});
  if (!begun) {
    return;
  }
  try {
    auto run = prepare(place);
    if (run) {
      start(job, *run, generation);
    } else if (run.error().code != ErrorCode::kNoSpace || !pause_for_room(job, nullptr)) {
      fail(job, nullptr, run.error());
    }
  } catch (const std::bad_alloc&) {
    fail(job, nullptr, Error{ErrorCode::kUnavailable, "not enough memory to load the job", ""});
  }
  remove_unused_film(*job);  // It may have been cancelled while it was loading.
}

core::Result<std::shared_ptr<const core::Renderer>> JobService::make_renderer(
    const api::JobSpec& spec, SceneService::Admission admission) {
  auto scene = scenes_.load(spec.scene, spec.time_seconds, spec.variant, admission);
  if (!scene) {
    return scene.error();
  }
  core::View view;
  view.scene = *scene;
  view.camera = spec.camera;
  view.settings = spec.render;
  if (spec.environment_choice == api::EnvironmentChoice::kGiven) {
    auto environment = scenes_.environment(spec.environment_asset, spec.environment, admission);
    if (!environment) {
      return environment.error();
    }
    view.environment = std::move(*environment);
  }
  return core::Renderer::create(std::move(view));
}

core::Result<std::shared_ptr<const core::Renderer>> JobService::make_admitted_renderer(
    const api::JobSpec& spec) {
  auto renderer = make_renderer(spec, SceneService::Admission::kGiven);
  // A dry run that loads the same scene may have had no memory for it. The job has.
  for (int tries = 0;
       tries < kLoadTries && !renderer && renderer.error().code == ErrorCode::kUnavailable;
       ++tries) {
    renderer = make_renderer(spec, SceneService::Admission::kGiven);
  }
  return renderer;
}

core::Result<std::shared_ptr<RenderRun>> JobService::prepare(
    const std::shared_ptr<JobBook::Place>& place) {
  const JobPointer& job = place->job();
  const JobRecord record = job->record();
  const api::JobSpec& spec = record.view.spec;
  if (auto fault = too_large(record.view)) {
    return Error{ErrorCode::kUnavailable, std::move(fault->detail), ""};
  }
  auto renderer = make_admitted_renderer(spec);
  if (!renderer) {
    return renderer.error();
  }
  book_.end_load(*job);
  RenderRun::Parts parts;
  parts.job = job;
  parts.place = place;
  parts.renderer = std::move(*renderer);
  parts.film = std::make_shared<core::Film>(spec.render);
  parts.scene_bytes = parts.renderer->view().scene->summary().bytes;
  parts.arithmetic = options_.arithmetic;
  parts.options.stop = spec.stop;
  parts.options.samples_limit = options_.samples_max;
  if (!job->memory_only()) {
    auto file = open_film_file(job, *parts.film, parts.options);
    if (!file) {
      return file.error();
    }
    parts.file.emplace(std::move(*file));
    films_.erase_prefix(film_key(*job));
  }
  if (const std::uint32_t seen = std::max(parts.film->revision(), record.view.progress.revision);
      seen > 0) {
    parts.film->restore(0, parts.film->tile(0), seen + kRevisionGap);
  }
  RenderRun::Owner& owner = *this;
  return std::make_shared<RenderRun>(std::move(parts), job->shared_log(), owner);
}

core::Result<FilmFile> JobService::make_film_file(Job& job) {
  const core::MutexLock changing(job.change_mutex());
  if (job.is_removed()) {
    return already_final();  // Its id, and the name of the file, may belong to another job.
  }
  return FilmFile::open(data_.film_path(job.id()));
}

core::Result<FilmFile> JobService::open_film_file(const JobPointer& job, core::Film& film,
                                                  core::TaskOptions& options) {
  const std::string path = data_.film_path(job->id());
  auto file = make_film_file(*job);
  if (!file) {
    return file.error();
  }
  auto restored = file->restore(film);
  if (!restored) {
    // The samples are a function of the job: they can be made again.
    log_.write(LogLevel::kWarning, "film_damaged",
               {{"job", job->id()}, {"detail", restored.error().message}});
    if (auto removed = remove_file(path); !removed) {
      return removed.error();
    }
    const Status warned =
        change(*job,
               [](JobRecord& record) {
                 record.view.warnings.emplace_back(
                     "The stored film was damaged; rendering begins anew and will end the same.");
                 return core::ok_status();
               },
               {.unstored = Unstored::kInMemory});
    if (!warned) {
      return warned.error();
    }
    file = make_film_file(*job);
    if (!file) {
      return file.error();
    }
    restored = file->restore(film);
    if (!restored) {
      return restored.error();
    }
  }
  if (const std::string& before = restored->arithmetic;
      !before.empty() && before != options_.arithmetic) {
    const Status warned = change(*job,
                                 [&](JobRecord& record) {
                                   record.view.warnings.push_back(
                                       "The film was begun with " + before + " and goes on with " +
                                       options_.arithmetic + "; its bits may be neither's.");
                                   return core::ok_status();
                                 },
                                 {.unstored = Unstored::kInMemory});
    if (!warned) {
      return warned.error();
    }
  }
  options.elapsed_before = restored->elapsed_seconds;
  options.points_before = std::move(restored->points);
  return file;
}

void JobService::start(const JobPointer& job, const std::shared_ptr<RenderRun>& run,
                       int generation) {
  bool is_paused = false;
  // Otherwise the job has ended, was deleted, or is being loaded anew: the run and its place go.
  static_cast<void>(
      change(*job,
             [&](JobRecord& record) -> Status {
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
               record.view.progress = progress_of(*run);
               record.view.peak_bytes = run->peak_bytes();
               record.view.split_count = run->task().renderer().measured_split_count();
               return core::ok_status();
             },
             {.unstored = Unstored::kInMemory, .before_telling = [&](const JobRecord& record) {
                // A patch while the scene was loading found no run to tell.
                run->task().set_stop(record.view.spec.stop);
                job->set_run(run);
                if (is_paused) {
                  run->task().set_paused(true);
                } else {
                  scheduler_.add(run, rank_of(record.view.spec), job->tenant());
                }
              }}));
}

void JobService::on_first_slice(const RenderRun& run) {
  if (const auto job = run.job()) {
    metrics_.count_queue_wait(unix_now() - job->record().view.created_at_unix_seconds);
  }
}

void JobService::on_end(std::shared_ptr<RenderRun> run) {
  JobPointer job = run->job();
  savers_.post([this, job = std::move(job), run = std::move(run)] {
    if (job && job->run() == run) {  // Else it was parked: the job goes on from its file.
      settle(job, run);
    }
  });
}

void JobService::settle(const JobPointer& job, const std::shared_ptr<RenderRun>& run) {
  const RenderRun::End end = *run->end();
  if (end.failure) {
    fail(job, run, *end.failure);
  } else if (end.reason == core::StopReason::kCancelled) {
    settle_cancelled(job, run);
  } else {
    finish(job, run, end.reason);
  }
}

bool JobService::pause_for_room(const JobPointer& job, const std::shared_ptr<RenderRun>& ended) {
  if (ended) {
    ended->leave_end();
  }
  if (job->state() == JobState::kPaused) {
    return true;
  }
  JobState before = JobState::kPaused;
  const Status paused =
      change(*job,
             [&](JobRecord& record) -> Status {
               before = record.view.state;
               if (api::is_final(before)) {
                 return already_final();
               }
               if (before != JobState::kPaused) {
                 record.view.state = JobState::kPaused;
                 record.view.pause_reason = api::PauseReason::kStorageFull;
               }
               if (const auto run = job->run()) {
                 record.view.progress = progress_of(*run);
               }
               return core::ok_status();
             },
             {.unstored = Unstored::kInMemory,
              .before_telling = [&](const JobRecord& after) { follow_state(job, before, after); }});
  // Whoever has cancelled it meanwhile may have taken the end.
  return paused || (ended && !ended->take_end());
}

void JobService::go_on_with_room() {
  if (!quota_.has_disk_room()) {
    return;
  }
  const auto has_room = [this](const RenderRun& run) {
    const auto space = disk_space(data_.path());
    return !space || space->free_bytes + run.file_bytes() >= FilmFile::disk_bytes_max(*run.film());
  };
  for (const JobPointer& job : book_.all()) {
    if (!job->waits_for_disk()) {
      continue;
    }
    const auto run = job->run();
    if (run && !has_room(*run)) {
      continue;
    }
    if (run && run->take_end()) {
      settle(job, run);
      continue;
    }
    if (run ? !run->save(false) : !make_film_file(*job)) {
      continue;
    }
    // Otherwise the job was cancelled or paused meanwhile.
    static_cast<void>(change(*job,
                             [&](JobRecord& record) -> Status {
                               if (record.view.pause_reason != api::PauseReason::kStorageFull ||
                                   job->run() != run) {
                                 return already_final();
                               }
                               record.view.state = run ? JobState::kRendering : JobState::kQueued;
                               record.view.pause_reason = api::PauseReason::kNone;
                               return core::ok_status();
                             },
                             {.before_telling = [&](const JobRecord& after) {
                               follow_state(job, JobState::kPaused, after);
                             }}));
  }
  admit();
}

void JobService::keep_film_of(const JobPointer& job, const RenderRun& run) {
  const std::uint64_t bytes = run.film()->bytes();
  auto stored = std::make_shared<const StoredFilm>(StoredFilm{
      .film = with_lease(run.film(), memory_.note({.bytes = bytes}, MemoryGate::Kind::kIdle)),
      .record = {.elapsed_seconds = run.task().progress().elapsed_seconds,
                 .points = run.task().points(),
                 .arithmetic = options_.arithmetic}});
  if (job->memory_only()) {
    job->keep_film(std::move(stored));
  } else {
    films_.put(film_key(*job), {.value = std::move(stored), .bytes = bytes});
  }
}

void JobService::finish(const JobPointer& job, const std::shared_ptr<RenderRun>& run,
                        core::StopReason reason) {
  scheduler_.remove(*run);
  const auto not_stored = [&](const Error& error) {
    if (error.code == ErrorCode::kCancelled ||
        (error.code == ErrorCode::kNoSpace && !pause_for_room(job, run))) {
      settle_cancelled(job, run);
    } else if (error.code != ErrorCode::kNoSpace) {
      fail(job, run, error);
    }
  };
  // On the disk first: who is told that a job has finished finds its film after a power loss, too.
  if (const Status saved = save_run(*run, quota_, job->memory_only(), true); !saved) {
    not_stored(saved.error());
    return;
  }
  const std::string digest = run->film()->digest();
  keep_film_of(job, *run);
  const Status told = change(
      *job,
      [&](JobRecord& record) -> Status {
        if (api::is_final(record.view.state)) {
          return already_final();
        }
        record.view.state = JobState::kFinished;
        record.view.pause_reason = api::PauseReason::kNone;
        record.view.stop_reason = reason;
        record.view.finished_at_unix_seconds = unix_now();
        record.view.progress = progress_of(*run);
        record.view.peak_bytes = run->peak_bytes();
        note_samples_by_error(record.view);
        record.view.film_digest = digest;
        record.view.build = options_.build;
        record.film = job->memory_only() ? FilmPlace::kNone : FilmPlace::kOnDisk;
        record.film_bytes = run->file_bytes();
        return core::ok_status();
      },
      {.unstored = Unstored::kRefused, .before_telling = [&](const JobRecord&) { release(job); }});
  if (told) {
    evict_films();
  } else {
    not_stored(told.error());
  }
}

void JobService::settle_cancelled(const JobPointer& job, const std::shared_ptr<RenderRun>& run) {
  if (job->is_removed()) {
    release(job);
    return;
  }
  const Status saved = save_run(*run, quota_, job->memory_only(), true);
  if (!saved) {
    log_.write(LogLevel::kError, "film_not_saved",
               {{"job", job->id()}, {"detail", saved.error().message}});
  }
  if (run->task().progress().samples_max > 0) {
    keep_film_of(job, *run);
  }
  const Status kept = change(
      *job,
      [&](JobRecord& record) {
        const double fraction = record.view.progress.fraction;
        record.view.progress = progress_of(*run);
        record.view.progress.fraction = fraction;
        record.view.build = options_.build;
        if (!saved) {
          record.view.warnings.emplace_back(
              "The picture could not be stored as it was when the job was cancelled; that of the "
              "last checkpoint is kept.");
        }
        if (saved && !job->memory_only() && record.view.progress.samples_max > 0) {
          record.film = FilmPlace::kOnDisk;
          record.film_bytes = run->file_bytes();
        }
        return core::ok_status();
      },
      {.unstored = Unstored::kInMemory, .before_telling = [&](const JobRecord&) { release(job); }});
  if (!kept) {
    release(job);
  }
  remove_unused_film(*job);
}

void JobService::fail(const JobPointer& job, const std::shared_ptr<RenderRun>& run,
                      const Error& failure) {
  const Status told = change(*job,
                             [&](JobRecord& record) -> Status {
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
                                 record.view.progress = progress_of(*run);
                                 record.view.progress.fraction =
                                     std::min(record.view.progress.fraction, 0.999);
                               }
                               return core::ok_status();
                             },
                             {.unstored = Unstored::kRefusedIfFull,
                              .before_telling = [&](const JobRecord&) { release(job); }});
  if (!told && told.error().code == ErrorCode::kNoSpace && pause_for_room(job, run)) {
    return;
  }
  if (!told) {
    release(job);
  }
  log_.write(LogLevel::kWarning, "job_failed", {{"job", job->id()}, {"detail", failure.message}});
  remove_unused_film(*job);
}

void JobService::release(const JobPointer& job) {
  if (const auto run = job->take_run()) {
    scheduler_.remove(*run);
    count_work(*run);
    run->leave();
  }
  book_.retire(job);
}

}  // namespace server
