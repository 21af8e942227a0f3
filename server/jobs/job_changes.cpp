// What clients change about a job: patch, cancel, extend, delete.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "api/errors.h"
#include "api/film_view.h"
#include "server/jobs/job_service.h"
#include "server/observe/clock.h"

namespace server {

using api::JobState;
using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

/// After the spec has changed from `before`: what was told of it and is so no longer goes, and
/// `more` comes.
void update_warnings(api::JobView& view, const api::JobSpec& before,
                     const std::vector<std::string>& more) {
  const auto about = [](const api::JobSpec& spec) {
    std::vector<std::string> warnings = api::adaptive_warnings(spec);
    for (std::string& warning : api::idle_warnings(spec)) {
      warnings.push_back(std::move(warning));
    }
    return warnings;
  };
  const auto holds = [](const std::vector<std::string>& list, const std::string& warning) {
    return std::find(list.begin(), list.end(), warning) != list.end();
  };
  const std::vector<std::string> old = about(before);
  std::vector<std::string> now = about(view.spec);
  now.insert(now.end(), more.begin(), more.end());
  const bool is_same_count = before.stop.samples_per_pixel == view.spec.stop.samples_per_pixel;
  std::erase_if(view.warnings, [&](const std::string& warning) {
    return !holds(now, warning) &&
           (holds(old, warning) || (!is_same_count && warning.starts_with(api::kSamplesWarning)));
  });
  for (const std::string& warning : now) {
    if (!holds(view.warnings, warning)) {
      view.warnings.push_back(warning);
    }
  }
}

}  // namespace

Status JobService::apply_patch(JobRecord& record, const Job& job,
                               const api::JobPatch& patch) const {
  api::JobView& view = record.view;
  const std::string state(api::to_text(view.state));
  if (api::is_final(view.state) && patch.stop_named) {
    return Error{ErrorCode::kConflict, "the job is " + state + "; use extend to let it go on",
                 "/stop"};
  }
  if (api::is_final(view.state) && patch.paused.value_or(false)) {
    return Error{ErrorCode::kConflict, "the job is " + state + " and cannot be paused", "/paused"};
  }
  const api::JobSpec before = view.spec;
  if (!api::same_spec(before, patch.spec)) {
    view.spec = patch.spec;
    ++view.spec_version;
  }
  update_warnings(view, before, patch.warnings);
  if (patch.paused && !api::is_final(view.state)) {
    if (*patch.paused) {
      view.state = JobState::kPaused;
    } else if (view.state == JobState::kPaused) {
      view.state = job.run() ? JobState::kRendering : JobState::kQueued;
    }
    if (const auto run = job.run()) {
      view.progress = progress_of(*run);
    }
  }
  return core::ok_status();
}

void JobService::follow_patch(const JobPointer& job, const JobRecord& before,
                              const JobRecord& after) {
  const api::JobSpec& spec = after.view.spec;
  const Rank rank = rank_of(spec);
  book_.set_rank(*job, rank);
  const auto run = job->run();
  if (run) {
    scheduler_.set_rank(*run, rank);
  }
  if (run && !api::is_final(after.view.state)) {
    run->task().set_stop(spec.stop);
  }
  if (before.view.state == after.view.state) {
    return;
  }
  if (after.view.state == JobState::kPaused) {
    book_.dequeue(*job);
    if (run) {
      scheduler_.remove(*run);
      run->task().set_paused(true);
    }
    book_.pause(*job);
  } else if (after.view.state == JobState::kRendering) {
    book_.claim(*job, rank);
    run->task().set_paused(false);
    scheduler_.add(run, rank, job->tenant());
  } else if (after.view.state == JobState::kQueued) {
    book_.enqueue(job, rank, memory_of(after.view));
  }
}

api::Parsed<std::monostate> JobService::patch(
    const JobPointer& job, std::string_view body,
    const std::optional<std::vector<std::uint32_t>>& if_versions, const Access& access) {
  std::optional<api::Problem> problem;
  JobRecord before;
  const Status changed =
      change(*job,
             [&](JobRecord& record) -> Status {
               before = record;
               if (if_versions && std::find(if_versions->begin(), if_versions->end(),
                                            record.view.spec_version) == if_versions->end()) {
                 return Error{ErrorCode::kPreconditionFailed,
                              "the spec has changed: it is version " +
                                  std::to_string(record.view.spec_version) +
                                  " now, which If-Match does not name",
                              ""};
               }
               auto parsed = api::parse_job_patch(body, record.view.spec);
               if (!parsed) {
                 problem = parsed.problem();
                 return Error{};
               }
               if (parsed->spec.priority != before.view.spec.priority) {
                 problem = refused_priority(parsed->spec.priority, access);
               }
               if (problem) {
                 return Error{};
               }
               return apply_patch(record, *job, *parsed);
             },
             {.go_on_in_memory = false,
              .before_telling = [&](const JobRecord& after) { follow_patch(job, before, after); }});
  if (problem) {
    return *problem;
  }
  if (!changed) {
    return api::from_error(changed.error());
  }
  admit();
  return std::monostate{};
}

Status JobService::cancel(const JobPointer& job) {
  bool was_final = false;
  const Status told = change(*job,
                             [&](JobRecord& record) {
                               was_final = api::is_final(record.view.state);
                               if (!was_final) {
                                 record.view.state = JobState::kCancelled;
                                 record.view.stop_reason = core::StopReason::kCancelled;
                                 record.view.finished_at_unix_seconds = unix_now();
                                 if (const auto run = job->run()) {
                                   record.view.progress = progress_of(*run);
                                   record.view.progress.eta_seconds.reset();
                                   record.view.progress.eta_low_seconds.reset();
                                   record.view.progress.eta_high_seconds.reset();
                                 }
                               }
                               return core::ok_status();
                             },
                             {.go_on_in_memory = true, .before_telling = [&](const JobRecord&) {
                                if (was_final) {
                                  return;
                                }
                                book_.dequeue(*job);
                                if (const auto run = job->run()) {
                                  scheduler_.remove(*run);
                                } else {
                                  release(job);
                                }
                              }});
  if (!told || was_final) {
    return told;
  }
  if (auto run = job->run()) {
    // The task may compute a last error estimate; nobody should wait for that.
    savers_.post([run = std::move(run)] { run->task().cancel(); });
  }
  admit();
  return core::ok_status();
}

api::Parsed<std::monostate> JobService::extend(const JobPointer& job, std::string_view body) {
  std::optional<api::Problem> problem;
  if (stopping_) {
    return api::make_problem(ErrorCode::kUnavailable, "the server is stopping");
  }
  const std::shared_lock<std::shared_mutex> naming(scenes_.names_mutex());
  if (const auto facts = scenes_.facts(job->record().view.spec.scene, Access::operators());
      !facts) {
    return api::make_problem(ErrorCode::kConflict, "the scene of the job is not there any more");
  }
  const Rank rank = rank_of(job->record().view.spec);
  if (!book_.has_room(rank, memory_of(job->record().view))) {
    return api::make_problem(ErrorCode::kTooManyRequests, book_.full_text(rank));
  }
  const auto counted = take_quota(job->tenant());
  if (!counted) {
    return counted.problem();
  }
  const Status changed = change(
      *job,
      [&](JobRecord& record) -> Status {
        api::JobView& view = record.view;
        auto parsed = api::parse_extend(body, view.spec);
        if (!parsed) {
          problem = parsed.problem();
          return Error{};
        }
        if (view.state != JobState::kFinished) {
          return Error{ErrorCode::kConflict,
                       "the job is " + std::string(api::to_text(view.state)) +
                           "; only a finished one can be extended",
                       ""};
        }
        if (!view.ledger.empty()) {
          return Error{ErrorCode::kConflict,
                       "the film was merged from samples that no single job goes on with: " +
                           api::ledger_words(view.ledger),
                       ""};
        }
        if (record.film != FilmPlace::kOnDisk) {
          return Error{ErrorCode::kConflict, "the film of the job is not there any more", ""};
        }
        const auto& samples = parsed->stop.samples_per_pixel;
        // The mean is off by a sample's fraction while an adaptive epoch is under way.
        const auto there = std::llround(view.progress.samples_mean);
        if (samples && *samples <= there) {
          return Error{ErrorCode::kInvalidArgument,
                       std::to_string(*samples) + " is not more than the " + std::to_string(there) +
                           " that are there",
                       "/stop/samples_per_pixel"};
        }
        const api::JobSpec before = view.spec;
        view.spec.stop = parsed->stop;
        ++view.spec_version;
        update_warnings(view, before, parsed->warnings);
        view.state = JobState::kQueued;
        view.stop_reason = core::StopReason::kNone;
        view.finished_at_unix_seconds.reset();
        view.film_digest.clear();
        view.progress.fraction = 0;
        return core::ok_status();
      },
      {.go_on_in_memory = false, .before_telling = [&](const JobRecord& after) {
         book_.enqueue(job, rank_of(after.view.spec), memory_of(after.view));
       }});
  if (problem) {
    return *problem;
  }
  if (!changed) {
    return api::from_error(changed.error());
  }
  admit();
  return std::monostate{};
}

Status JobService::remove(const JobPointer& job) {
  const core::MutexLock changing(job->change_mutex());
  if (job->is_removed()) {
    return Error{ErrorCode::kNotFound, "the job was deleted", ""};
  }
  const JobState state = job->state();
  if (!api::is_final(state)) {
    return Error{ErrorCode::kConflict,
                 "the job is " + std::string(api::to_text(state)) + "; cancel it first", ""};
  }
  if (!job->memory_only()) {
    if (auto removed = table_.remove(job->id()); !removed) {
      return removed;
    }
    remove_loose_film(job->id());
  }
  job->set_removed();
  book_.forget(*job);
  films_.erase_prefix(film_key(*job));
  return core::ok_status();
}

}  // namespace server
