// A film from elsewhere becomes a finished job.

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <utility>

#include "core/error/error_estimate.h"
#include "server/jobs/job_service.h"
#include "server/observe/clock.h"
#include "server/store/uuid.h"

namespace server {

using api::JobState;
using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

constexpr std::chrono::seconds kSettleTime{10};
constexpr std::chrono::milliseconds kSettleLook{5};

bool has_samples(const core::Film& film) { return film.sample_counts().max > 0; }

/// Everything but its identity.
api::JobView view_of_finished(const JobService::FinishedFilm& finished) {
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
  progress.error = core::ErrorEstimate(film).image(finished.spec.stop.confidence);
  const double error = progress.error.relative_rmse;
  if (error > 0 && progress.cpu_seconds > 0) {
    progress.efficiency = 1 / (error * error * progress.cpu_seconds);
  }
  if (progress.elapsed_seconds > 0) {
    progress.rays_per_second = static_cast<double>(progress.rays) / progress.elapsed_seconds;
  }
  return view;
}

/// Bytes on the disk.
core::Result<std::uint64_t> write_new_film(const std::string& path, const core::Film& film,
                                           const FilmRecord& beside,
                                           const core::FilmSettings& settings) {
  auto file = FilmFile::open(path);
  if (!file) {
    return file.error();
  }
  core::Film nothing(settings, film.replicates());
  if (const auto blank = file->restore(nothing); !blank) {
    return blank.error();
  }
  if (const auto written = file->write(film, beside, true); !written) {
    return written.error();
  }
  if (const auto synced = sync_directory(std::filesystem::path(path).parent_path().string());
      !synced) {
    return synced.error();
  }
  return file->disk_bytes();
}

}  // namespace

core::Result<std::shared_ptr<const core::Film>> JobService::final_film(
    const Job& job, const std::stop_token& stop) {
  const JobState state = job.state();
  if (!api::is_final(state)) {
    return Error{
        ErrorCode::kConflict,
        "the job is " + std::string(api::to_text(state)) + "; its film is there when it has ended",
        ""};
  }
  // A cancelled job is told to be so before its last slices have ended.
  core::Mutex mutex;
  core::CondVar never;
  const auto deadline = std::chrono::steady_clock::now() + kSettleTime;
  while (job.run() && !stop.stop_requested()) {
    if (std::chrono::steady_clock::now() > deadline) {
      return Error{ErrorCode::kUnavailable, "the film is still being stored", ""};
    }
    const core::MutexLock lock(mutex);
    never.wait_for(mutex, stop, kSettleLook, [] { return false; });
  }
  auto stored = stored_film(job);
  if (!stored) {
    return stored.error();
  }
  if (!has_samples(*(*stored)->film)) {
    return Error{ErrorCode::kConflict, "the job has no sample", ""};
  }
  return (*stored)->film;
}

core::Result<JobPointer> JobService::add_finished(FinishedFilm finished) {
  if (auto refused = refused_work()) {
    return *std::move(refused);
  }
  const core::Film& film = *finished.film;
  JobRecord record;
  record.view = view_of_finished(finished);
  record.sequence = ++last_sequence_;
  record.view.id = make_uuid();
  record.tenant = finished.tenant;
  const core::ConvergencePoint point{.samples_per_pixel = record.view.progress.samples_max,
                                     .elapsed_seconds = finished.elapsed_seconds,
                                     .cpu_seconds = record.view.progress.cpu_seconds,
                                     .rays = record.view.progress.rays,
                                     .error = record.view.progress.error};
  const FilmRecord beside{.elapsed_seconds = finished.elapsed_seconds,
                          .points = {point},
                          .arithmetic = finished.arithmetic};
  StorageQuota::Room room = quota_.room(finished.tenant, StorageQuota::Kind::kFilm);
  if (const Status fits = room.grow_to(FilmFile::disk_bytes_max(film)); !fits) {
    return fits.error();
  }
  if (const Status noted = table_.note_loose_film(record.view.id); !noted) {
    return noted.error();
  }
  const std::string path = data_.film_path(record.view.id);
  auto bytes = write_new_film(path, film, beside, finished.spec.render.film);
  if (!bytes) {
    remove_loose_film(record.view.id);
    return bytes.error();
  }
  record.film = FilmPlace::kOnDisk;
  record.film_bytes = *bytes;
  auto job = std::make_shared<Job>(record, Job::History::kInLog);
  std::vector<Told> told = events_between(*job, JobRecord{}, record);
  std::vector<EventRow> rows;
  const std::uint64_t first = reserve_events(*job, told, rows);
  JobRow row = to_row(record);
  if (const Status stored = table_.insert(row, rows, std::nullopt); !stored) {
    remove_loose_film(record.view.id);
    return stored.error();
  }
  job->set_end_mark(EndMark{.stream = run_, .seq = first + told.size() - 1});
  const std::uint64_t cached = film.bytes();
  films_.put(job->id(), {.value = std::make_shared<const StoredFilm>(
                             StoredFilm{.film = finished.film, .record = beside}),
                         .bytes = cached});
  publish_events(*job, first, std::move(told));
  log_.write(LogLevel::kInfo, "job_merged", {{"job", job->id()}});
  job = book_.add_final(job);
  evict_films();
  return job;
}

}  // namespace server
