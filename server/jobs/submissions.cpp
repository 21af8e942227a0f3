#include "server/jobs/submissions.h"

#include <shared_mutex>
#include <utility>

#include "api/json/error_codes.h"
#include "api/json/errors.h"
#include "core/error/error_estimate.h"
#include "core/integrators/registry.h"
#include "server/observe/clock.h"
#include "server/scenes/scene_facts.h"
#include "server/store/film_file.h"
#include "server/store/uuid.h"

namespace server {

using api::JobState;
using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

/// Keys of ids and of Idempotency-Keys in one table. A tenant's name contains no space.
std::string own_id_key(const std::string& id) { return "put " + id; }
std::string key_of(const Submissions::Submission& submission) {
  return (submission.is_by_content ? "content " : "of ") + submission.access.tenant + " " +
         submission.key;
}

/// Returns whether the job still is that of its first request, and has an image that is not
/// doubted or will have one, or has failed too recently to be tried again.
bool still_answers(const Job& job, double failed_seconds) {
  const JobRecord record = job.record();
  const api::JobView& view = record.view;
  if (view.spec_version != api::JobView{}.spec_version) {
    return false;
  }
  if (view.state == JobState::kFailed) {
    return unix_now() - view.finished_at_unix_seconds.value_or(0) < failed_seconds;
  }
  return view.state != JobState::kCancelled && record.film != FilmPlace::kEvicted &&
         !view.is_doubted;
}

/// Returns a view without the job's identity.
api::JobView view_of_finished(const Submissions::FinishedFilm& finished) {
  const core::Film& film = *finished.film;
  api::JobView view;
  view.state = JobState::kFinished;
  view.stop_reason = finished.stop_reason;
  view.created_at_unix_seconds = unix_now();
  view.started_at_unix_seconds = view.created_at_unix_seconds;
  view.finished_at_unix_seconds = view.created_at_unix_seconds;
  view.spec = finished.spec;
  view.warnings = finished.warnings;
  view.build = finished.build;
  view.ledger = finished.ledger;
  view.film_digest = film.digest();
  if (finished.is_doubted) {
    doubt(view);
  }
  view.peak_bytes = film.bytes();
  core::Progress& progress = view.progress;
  progress.fraction = 1;
  const core::SampleCounts counts = film.sample_counts();
  progress.samples_min = static_cast<int>(counts.min);
  progress.samples_mean = counts.mean;
  progress.samples_max = static_cast<int>(counts.max);
  progress.elapsed_seconds = finished.elapsed_seconds;
  progress.cpu_seconds = film.cpu_seconds();
  progress.rays = film.rays();
  progress.rejected_samples = film.rejected_samples();
  progress.revision = film.revision();
  note_samples_by_error(view);
  if (core::halves_show_error(finished.spec.render)) {
    progress.error = core::ErrorEstimate(film).image(finished.spec.stop.confidence);
  } else {
    progress.error = core::unknown_error();
  }
  if (progress.elapsed_seconds > 0) {
    progress.rays_per_second = static_cast<double>(progress.rays) / progress.elapsed_seconds;
  }
  return view;
}

}  // namespace

Verdict priority_allowed(int priority, const Access& access, std::string pointer) {
  if (priority <= access.priority_max) {
    return {};
  }
  return api::make_problem(
      ErrorCode::kInvalidArgument,
      {api::FieldError{std::move(pointer), std::to_string(priority) + " is more than " +
                                               std::to_string(access.priority_max) +
                                               ", the highest priority that this key allows"}});
}

std::optional<Error> Submissions::refused_work() const {
  if (!parts_.life.is_stopping() && !parts_.life.is_draining()) {
    return std::nullopt;
  }
  return Error{ErrorCode::kUnavailable,
               parts_.life.is_stopping() ? "the server is stopping"
                                         : "the server is draining and accepts no new jobs",
               ""};
}

api::Parsed<Submissions::Checked> Submissions::check(api::ParsedJob request, const Access& access) {
  auto facts = parts_.scenes.facts(request.spec.scene, access);
  if (!facts) {
    Error error = facts.error();
    error.where = "/scene";
    return api::from_error(error);
  }
  if (auto faults = faults_against_scene(request.spec, *facts); !faults.empty()) {
    return api::make_problem(ErrorCode::kInvalidArgument, std::move(faults));
  }
  if (request.spec.environment_asset) {
    if (const auto usable =
            parts_.scenes.check_environment(*request.spec.environment_asset, access);
        !usable) {
      return api::from_error(usable.error());
    }
  }
  if (auto warning = api::resolve_environment(request.spec, *facts)) {
    request.warnings.push_back(std::move(*warning));
  }
  const double kept = options_.retention_seconds;
  if (kept > 0 && request.spec.retention_seconds.value_or(0) > kept) {
    request.warnings.push_back("This server deletes jobs " +
                               std::to_string(static_cast<std::int64_t>(kept)) +
                               " seconds after they have ended.");
  }
  const std::vector<std::string> more = api::adaptive_warnings(request.spec);
  request.warnings.insert(request.warnings.end(), more.begin(), more.end());
  Admission admission = parts_.builder.admission_of(request.spec);
  if (auto fault = parts_.builder.too_large(request.spec, admission.memory)) {
    return api::make_problem(ErrorCode::kTooLarge, {std::move(*fault)});
  }
  return Checked{.job = std::move(request), .admission = std::move(admission)};
}

core::Result<JobPointer> Submissions::find_replay(const Submission& submission) {
  std::optional<IdempotencyRow> row;
  {
    auto stored = parts_.table.find_key(key_of(submission));
    if (!stored) {
      return stored.error();
    }
    row = std::move(*stored);
  }
  if (!row || (!submission.is_by_content && row->created_at < unix_now() - kKeySeconds)) {
    return JobPointer();
  }
  auto job = parts_.index.find(row->job, submission.access);
  if (!job) {
    return job.error().code == ErrorCode::kNotFound ? core::Result<JobPointer>(JobPointer()) : job;
  }
  if (row->body_hash != submission.body_hash) {
    return Error{ErrorCode::kConflict,
                 "this Idempotency-Key was used with another body, for job " + row->job, ""};
  }
  return job;
}

core::Result<JobPointer> Submissions::find_equal(const Submission& submission) {
  auto job = submission.id.empty() ? find_replay(submission) : find_own_id(submission);
  if (job && *job && submission.is_by_content && !still_answers(**job, submission.failed_seconds)) {
    return JobPointer();
  }
  return job;
}

core::Result<JobPointer> Submissions::find_own_id(const Submission& submission) {
  auto job = parts_.index.find(submission.id);  // Ids are unique across all tenants.
  if (!job) {
    return job.error().code == ErrorCode::kNotFound ? core::Result<JobPointer>(JobPointer()) : job;
  }
  if (!submission.access.sees((*job)->tenant())) {
    return parts_.index.find(submission.id, submission.access);
  }
  const auto row = parts_.table.find_key(own_id_key(submission.id));
  if (!row) {
    return row.error();
  }
  if (!*row || (*row)->body_hash != submission.body_hash) {
    return Error{ErrorCode::kConflict,
                 "the job " + submission.id + " already exists with a different body", ""};
  }
  return job;
}

api::Parsed<std::unique_lock<core::Mutex>> Submissions::take_quota(const std::string& tenant,
                                                                   int jobs) {
  if (tenant.empty() || options_.quota_jobs == 0) {
    return std::unique_lock<core::Mutex>();
  }
  std::unique_lock<core::Mutex> held(quota_mutex_);
  const auto count = parts_.table.unfinished_of(tenant);
  if (!count) {
    return api::from_error(count.error());
  }
  if (*count + jobs <= options_.quota_jobs) {
    return api::Parsed<std::unique_lock<core::Mutex>>(std::move(held));
  }
  return api::make_problem(api::kTooManyRequests,
                           "the tenant '" + tenant + "' has " + std::to_string(*count) +
                               " unfinished jobs; at most " + std::to_string(options_.quota_jobs) +
                               " are allowed");
}

api::Parsed<Submissions::Submitted> Submissions::submit(api::ParsedJob request,
                                                        const Submission& submission) {
  std::unique_lock<core::Mutex> keyed;
  if (!submission.key.empty() || !submission.id.empty()) {
    keyed = std::unique_lock<core::Mutex>(keyed_mutex_);
    auto replay = find_equal(submission);
    if (!replay) {
      return api::from_error(replay.error());
    }
    if (*replay) {
      return Submitted{.job = std::move(*replay), .is_replay = true};
    }
  }
  if (const auto refused = refused_work()) {
    return api::from_error(*refused);
  }
  if (const Verdict allowed = priority_allowed(request.spec.priority, submission.access);
      !allowed) {
    return allowed.problem();
  }
  // The scene and the asset found here must not be deleted before the record refers to them.
  const std::shared_lock<std::shared_mutex> naming(parts_.scenes.names_mutex());
  auto checked = check(std::move(request), submission.access);
  if (!checked) {
    return checked.problem();
  }
  if (!parts_.book.has_room(checked->admission, submission.access.tenant)) {
    return api::make_problem(api::kTooManyRequests, parts_.book.full_text(checked->admission.rank));
  }
  const auto counted = take_quota(submission.access.tenant);
  if (!counted) {
    return counted.problem();
  }
  const std::optional<std::string> preview_key = checked->job.spec.preview_key;
  auto job = insert(std::move(checked->job), submission, checked->admission.film_file_bytes);
  if (!job) {
    return api::from_error(job.error());
  }
  if (preview_key) {
    supersede(*preview_key, **job, submission.access);
  }
  parts_.book.enqueue(*job, std::move(checked->admission));
  parts_.life.admit();
  return Submitted{.job = std::move(*job), .is_replay = false};
}

api::Parsed<std::vector<JobPointer>> Submissions::submit_together(
    std::vector<api::ParsedJob> requests, const Together& together) {
  if (const auto refused = refused_work()) {
    return api::from_error(*refused);
  }
  const std::shared_lock<std::shared_mutex> naming(parts_.scenes.names_mutex());
  std::vector<Checked> all;
  for (api::ParsedJob& request : requests) {
    if (const Verdict allowed = priority_allowed(request.spec.priority, together.access);
        !allowed) {
      return allowed.problem();
    }
    auto checked = check(std::move(request), together.access);
    if (!checked) {
      return checked.problem();
    }
    all.push_back(*std::move(checked));
  }
  const auto jobs = static_cast<int>(all.size());
  if (!parts_.book.has_room_for(jobs)) {
    return api::make_problem(api::kTooManyRequests,
                             "the queue has no room for " + std::to_string(jobs) + " more jobs");
  }
  const auto counted = take_quota(together.access.tenant, jobs);
  if (!counted) {
    return counted.problem();
  }
  auto made = insert_together(all, together);
  if (!made) {
    return api::from_error(made.error());
  }
  std::vector<JobBook::Entry> entries;
  for (std::size_t i = 0; i < all.size(); ++i) {
    entries.push_back({.job = (*made)[i], .admission = std::move(all[i].admission)});
  }
  parts_.book.enqueue(std::move(entries));
  parts_.life.admit();
  return *std::move(made);
}

core::Result<std::vector<JobPointer>> Submissions::insert_together(std::vector<Checked>& requests,
                                                                   const Together& together) {
  std::vector<JobPointer> jobs;
  std::vector<std::int64_t> sequences;
  std::vector<std::uint64_t> reserved;
  std::uint64_t reserved_in_all = 0;
  for (auto& [request, admission] : requests) {
    JobRecord record;
    record.sequence = ++last_sequence_;
    record.tenant = together.access.tenant;
    record.view.id = make_uuid();
    record.view.created_at_unix_seconds = unix_now();
    record.view.spec = std::move(request.spec);
    record.view.warnings = std::move(request.warnings);
    reserved.push_back(record.tenant.empty() ? 0 : admission.film_file_bytes);
    reserved_in_all += reserved.back();
    sequences.push_back(record.sequence);
    jobs.push_back(std::make_shared<Job>(std::move(record), Job::History::kInLog));
  }
  StorageQuota::Room room = parts_.quota.room(together.access.tenant, StorageQuota::Kind::kFilm);
  if (const Status fits = room.grow_to(reserved_in_all); !fits) {
    return Error{fits.error().code, fits.error().message, "/film"};
  }
  const auto beside = [&](Database::Session& session) {
    return together.beside(session, sequences);
  };
  if (const Status stored = parts_.journal.enter_together(jobs, reserved, together.key, beside);
      !stored) {
    return stored.error();
  }
  for (const JobPointer& job : jobs) {
    parts_.book.add(job);
  }
  parts_.log.write(
      LogLevel::kInfo, "batch_submitted",
      {{"jobs", static_cast<std::int64_t>(jobs.size())}, {"tenant", together.access.tenant}});
  return jobs;
}

core::Result<JobPointer> Submissions::insert(api::ParsedJob request, const Submission& submission,
                                             std::uint64_t film_file_bytes) {
  JobRecord record;
  record.sequence = ++last_sequence_;
  record.tenant = submission.access.tenant;
  record.view.id = submission.id.empty() ? make_uuid() : submission.id;
  record.view.created_at_unix_seconds = unix_now();
  record.view.spec = std::move(request.spec);
  record.view.warnings = std::move(request.warnings);
  record.view.samples_by_error = request.samples_by_error;
  auto job = std::make_shared<Job>(record, Job::History::kInLog);
  Journal::Beside beside;
  if (!submission.key.empty() || !submission.id.empty()) {
    beside.key = IdempotencyRow{
        .key = submission.id.empty() ? key_of(submission) : own_id_key(submission.id),
        .body_hash = submission.body_hash,
        .job = record.view.id,
        .created_at = record.view.created_at_unix_seconds};
  }
  StorageQuota::Room room = parts_.quota.room(record.tenant, StorageQuota::Kind::kFilm);
  if (!record.tenant.empty() && !job->memory_only()) {
    beside.reserved_bytes = film_file_bytes;
    if (const Status fits = room.grow_to(beside.reserved_bytes); !fits) {
      return Error{fits.error().code, fits.error().message, "/film"};
    }
  }
  {
    // Added before it is stored: other requests with the same id wait for the commit and get this
    // job.
    const core::MutexLock changing(job->change_mutex());
    parts_.book.add(job);
    if (const Status stored = parts_.journal.enter(*job, beside); !stored) {
      job->set_removed();
      parts_.book.forget(*job);
      return stored.error();
    }
  }
  parts_.log.write(
      LogLevel::kInfo, "job_submitted",
      {{"job", record.view.id}, {"scene", record.view.spec.scene}, {"tenant", record.tenant}});
  return job;
}

void Submissions::supersede(const std::string& preview_key, const Job& by, const Access& access) {
  for (const JobPointer& job : parts_.book.all()) {
    const JobRecord record = job->record();
    if (job->memory_only() && job->id() != by.id() && access.shares_names_with(job->tenant()) &&
        record.view.spec.preview_key == preview_key && !api::is_final(record.view.state)) {
      static_cast<void>(parts_.life.cancel(job));  // Fails only for a job that has already ended.
    }
  }
}

core::Result<JobPointer> Submissions::add_finished(FinishedFilm finished) {
  if (auto refused = refused_work()) {
    return *std::move(refused);
  }
  const core::Film& film = *finished.film;
  JobRecord record;
  record.view = view_of_finished(finished);
  if (!record.view.spec.render.meter.empty()) {
    record.view.spec.render.meter = {};
    record.view.warnings.emplace_back(
        "meter: films contain no readings, so the merged job has none.");
  }
  record.sequence = ++last_sequence_;
  record.view.id = make_uuid();
  record.tenant = finished.tenant;
  record.unverified = std::move(finished.unverified);
  const core::ConvergencePoint point{.samples_per_pixel = record.view.progress.samples_max,
                                     .elapsed_seconds = finished.elapsed_seconds,
                                     .cpu_seconds = record.view.progress.cpu_seconds,
                                     .rays = record.view.progress.rays,
                                     .error = record.view.progress.error};
  const FilmRecord beside{.elapsed_seconds = finished.elapsed_seconds,
                          .points = {point},
                          .arithmetic = finished.arithmetic};
  StorageQuota::Room room = parts_.quota.room(finished.tenant, StorageQuota::Kind::kFilm);
  if (const Status fits = room.grow_to(FilmFile::disk_bytes_max(film)); !fits) {
    return fits.error();
  }
  auto bytes = parts_.films.write_new(record.view.id, film, beside, finished.spec.render.film);
  if (!bytes) {
    return bytes.error();
  }
  record.film = FilmPlace::kOnDisk;
  record.film_bytes = *bytes;
  auto job = std::make_shared<Job>(record, Job::History::kInLog);
  if (const Status stored = parts_.journal.enter(*job, {}); !stored) {
    parts_.films.remove_loose(record.view.id);
    return stored.error();
  }
  parts_.films.keep(*job, finished.film, beside);
  parts_.log.write(LogLevel::kInfo, "job_merged", {{"job", job->id()}});
  job = parts_.book.add_final(job);
  parts_.films.evict();
  return job;
}

}  // namespace server
