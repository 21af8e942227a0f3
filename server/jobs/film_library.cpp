#include "server/jobs/film_library.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <string_view>
#include <utility>

#include <fcntl.h>

#include "api/json/error_codes.h"
#include "core/base/mutex.h"
#include "server/jobs/job_record.h"
#include "server/store/files.h"

namespace server {

using api::JobState;
using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

constexpr int kEvictAtATime = 16;
constexpr std::chrono::seconds kSettleTime{10};
constexpr std::chrono::milliseconds kSavingPoll{5};

Error no_sample_yet() { return Error{ErrorCode::kConflict, "the job has no sample yet", ""}; }

bool has_samples(const core::Film& film) {
  for (int tile = 0; tile < film.tile_count(); ++tile) {
    if (film.tile_samples(tile) > 0) {
      return true;
    }
  }
  return false;
}

}  // namespace

core::Result<std::shared_ptr<const StoredFilm>> FilmLibrary::stored(const Job& job) {
  if (auto kept = job.kept_film()) {
    return kept;
  }
  const JobRecord record = job.record();
  if (record.film == FilmPlace::kEvicted) {
    return Error{api::kGone, "the film was evicted to keep the disk below its limit", ""};
  }
  if (job.memory_only() || (api::is_final(record.view.state) && record.film == FilmPlace::kNone)) {
    return no_sample_yet();
  }
  using Made = SingleFlightCache<StoredFilm>::Made;
  auto made = cache_.get(key_of(job), [&]() -> core::Result<Made> {
    auto film = read(job, record);
    if (!film) {
      return film.error();
    }
    const std::uint64_t bytes = film->film->bytes();
    return Made{.value = std::make_shared<const StoredFilm>(*std::move(film)), .bytes = bytes};
  });
  drop_if_removed(job);
  return !made && made.error().code == api::kGone ? report_damage(job, made.error()) : made;
}

core::Result<StoredFilm> FilmLibrary::read(const Job& job, const JobRecord& record) {
  const std::string path = parts_.data.film_path(job.id());
  const bool is_kept = api::is_final(record.view.state) && record.film == FilmPlace::kOnDisk;
  if (const auto there = open_file(path, O_RDONLY); !there) {
    return there.error().code != ErrorCode::kNotFound ? there.error()
           : is_kept                                  ? Error{api::kGone, "its file is missing", ""}
                                                      : no_sample_yet();
  }
  auto file = FilmFile::open(path);
  if (!file) {
    return file.error();
  }
  auto film = blank_film(record.view);
  const std::uint64_t bytes = film->bytes();
  const auto lease = parts_.memory.take({.bytes = bytes, .tenant = job.tenant()}, "the film");
  if (!lease) {
    return lease.error();
  }
  auto restored = file->restore(*film);
  if (!restored) {
    const bool may_be_whole = !is_kept || restored.error().code == ErrorCode::kUnavailable;
    return may_be_whole ? restored.error() : Error{api::kGone, restored.error().message, ""};
  }
  const auto samples = static_cast<int>(film->sample_counts().max);
  if (record.view.state == api::JobState::kFinished && samples < record.view.progress.samples_max) {
    return Error{api::kGone,
                 "it has " + std::to_string(samples) + " of " +
                     std::to_string(record.view.progress.samples_max) + " samples",
                 ""};
  }
  return StoredFilm{
      .film = with_lease(std::move(film),
                         parts_.memory.note({.bytes = bytes}, MemoryGate::Kind::kIdle)),
      .record = std::move(*restored)};
}

Error FilmLibrary::report_damage(const Job& job, const Error& damage) {
  constexpr std::string_view kWords = "The stored film is lost or damaged";
  const auto found = parts_.index.find(job.id());
  const auto is_known = [&](const std::string& warning) { return warning.starts_with(kWords); };
  if (found && (*found)->sequence() == job.sequence()) {
    const Verdict noted = parts_.journal.change(
        **found,
        [&](JobRecord& record) -> Verdict {
          if (std::any_of(record.view.warnings.begin(), record.view.warnings.end(), is_known)) {
            return Error{ErrorCode::kCancelled, "", ""};
          }
          record.view.warnings.push_back(std::string(kWords) + " (" + damage.message +
                                         "). It is not rendered again automatically; submitting "
                                         "the same job again gives the same film.");
          return {};
        },
        {.unstored = Journal::Unstored::kInMemory});
    if (noted) {
      parts_.log.write(LogLevel::kError, "film_damaged",
                       {{"job", job.id()}, {"detail", damage.message}});
    }
  }
  return Error{api::kGone, "the stored film is lost or damaged: " + damage.message, ""};
}

core::Result<std::shared_ptr<const core::Film>> FilmLibrary::film(const Job& job) {
  std::shared_ptr<const core::Film> film;
  if (const auto run = job.run()) {
    film = run->film();
  } else {
    const auto kept = stored(job);
    if (!kept) {
      return kept.error();
    }
    film = (*kept)->film;
  }
  if (!has_samples(*film)) {
    return no_sample_yet();
  }
  return film;
}

core::Result<std::shared_ptr<const core::Film>> FilmLibrary::final_film(
    const Job& job, const std::stop_token& stop) {
  const JobState state = job.state();
  if (!api::is_final(state)) {
    return Error{ErrorCode::kConflict,
                 "the job is " + std::string(api::to_text(state)) +
                     "; its film is available once it has ended",
                 ""};
  }
  // A job is published as cancelled before its last slices end.
  core::Mutex mutex;
  core::CondVar never;
  const auto deadline = std::chrono::steady_clock::now() + kSettleTime;
  while (job.run() && !stop.stop_requested()) {
    if (std::chrono::steady_clock::now() > deadline) {
      return Error{ErrorCode::kUnavailable, "the film is still being stored", ""};
    }
    const core::MutexLock lock(mutex);
    never.wait_for(mutex, stop, kSavingPoll, [] { return false; });
  }
  auto kept = stored(job);
  if (!kept) {
    return kept.error();
  }
  if (!has_samples(*(*kept)->film)) {
    return Error{ErrorCode::kConflict, "the job has no sample", ""};
  }
  return (*kept)->film;
}

std::vector<core::ConvergencePoint> FilmLibrary::points(const Job& job) {
  if (const auto run = job.run()) {
    return run->task().points();
  }
  const auto kept = stored(job);
  return kept ? (*kept)->record.points : std::vector<core::ConvergencePoint>();
}

void FilmLibrary::keep(Job& job, std::shared_ptr<const core::Film> film, FilmRecord record) {
  const std::uint64_t bytes = film->bytes();
  auto kept = std::make_shared<const StoredFilm>(
      StoredFilm{.film = with_lease(std::move(film),
                                    parts_.memory.note({.bytes = bytes}, MemoryGate::Kind::kIdle)),
                 .record = std::move(record)});
  if (job.memory_only()) {
    job.keep_film(std::move(kept));
    return;
  }
  cache_.put(key_of(job), {.value = std::move(kept), .bytes = bytes});
  drop_if_removed(job);
}

void FilmLibrary::drop_if_removed(const Job& job) {
  if (job.is_removed()) {  // remove() may have run before the film was cached.
    drop(job);
  }
}

core::Result<FilmFile> FilmLibrary::open_film_file(Job& job) {
  const core::MutexLock changing(job.change_mutex());
  if (job.is_removed()) {
    // The id, and thus the file name, may belong to another job by now.
    return Error{ErrorCode::kCancelled, "the job was deleted", ""};
  }
  return FilmFile::open(parts_.data.film_path(job.id()));
}

core::Result<std::uint64_t> FilmLibrary::write_new(const std::string& id, const core::Film& film,
                                                   const FilmRecord& record,
                                                   const core::FilmSettings& settings) {
  if (const Status noted = parts_.table.note_loose_film(id); !noted) {
    return noted.error();
  }
  const std::string path = parts_.data.film_path(id);
  const auto write = [&]() -> core::Result<std::uint64_t> {
    auto file = FilmFile::open(path);
    if (!file) {
      return file.error();
    }
    core::Film nothing(settings, film.replicates());
    if (const auto blank = file->restore(nothing); !blank) {
      return blank.error();
    }
    if (const auto written = file->write(film, record, true); !written) {
      return written.error();
    }
    if (const auto synced = sync_directory(std::filesystem::path(path).parent_path().string());
        !synced) {
      return synced.error();
    }
    return file->disk_bytes();
  };
  auto bytes = write();
  if (!bytes) {
    remove_loose(id);
  }
  return bytes;
}

void FilmLibrary::remove_loose(const std::string& id) {
  Status removed =
      remove_file(parts_.data.first_images_path(id));  // First: nothing else refers to it.
  if (removed) {
    removed = remove_file(parts_.data.film_path(id));
  }
  // Otherwise a power failure could bring back files that nothing refers to.
  for (const std::string& folder : {parts_.data.first_images_path(), parts_.data.films_path()}) {
    removed = removed ? sync_directory(folder) : removed;
  }
  const Status forgotten = removed ? parts_.table.forget_loose_film(id) : removed;
  if (!forgotten) {
    parts_.log.write(LogLevel::kWarning, "loose_film_stays",
                     {{"job", id}, {"detail", forgotten.error().message}});
  }
}

void FilmLibrary::remove_all_loose() {
  const auto loose = parts_.table.loose_films();
  for (const std::string& id : loose ? *loose : std::vector<std::string>()) {
    remove_loose(id);
  }
}

Status FilmLibrary::announce_removal(const Job& job) {
  return job.memory_only() ? core::ok_status() : parts_.table.note_loose_film(job.id());
}

void FilmLibrary::remove_forgotten(const Job& job) {
  drop(job);
  if (!job.memory_only()) {
    remove_loose(job.id());
  }
}

void FilmLibrary::remove_unused(Job& job) {
  const core::MutexLock changing(job.change_mutex());
  const JobRecord record = job.record();
  // A run of an ended job may have written its film and not yet recorded it.
  if (!job.memory_only() && !job.is_removed() && api::is_final(record.view.state) &&
      record.film == FilmPlace::kNone && !job.run()) {
    remove_loose(job.id());
  }
}

bool FilmLibrary::evict(const JobRow& row) {
  const auto job = parts_.index.find(row.id);
  // Recorded first: if the process ends before the file is removed, the next start removes it.
  if (!job || !parts_.table.note_loose_film(row.id)) {
    return false;
  }
  const Verdict evicted = parts_.journal.change(
      **job,
      [](JobRecord& record) -> Verdict {
        if (!api::is_final(record.view.state) || record.film != FilmPlace::kOnDisk) {
          return Error{ErrorCode::kConflict, "", ""};
        }
        record.film = FilmPlace::kEvicted;
        return {};
      },
      // Before the job can be deleted and its id, and this file name, be reused by another job.
      {.unstored = Journal::Unstored::kRefused,
       .before_publishing = [&](const JobRecord&) { remove_loose(row.id); }});
  if (!evicted) {
    return false;
  }
  cache_.erase_prefix(key_of(**job));
  parts_.metrics.count(Counter::kFilmEvicted);
  parts_.log.write(LogLevel::kInfo, "film_evicted", {{"job", row.id}});
  return true;
}

void FilmLibrary::evict() {
  const std::uint64_t limit = parts_.quota.limits().total_bytes;
  const auto stored = parts_.quota.total();
  if (limit == 0 || !stored) {
    return;
  }
  std::uint64_t total = stored->asset_bytes + stored->film_bytes;
  bool goes_on = true;
  while (total > limit && goes_on) {
    const auto oldest = parts_.table.films_oldest_first(kEvictAtATime);
    goes_on = false;
    for (const JobRow& row : oldest ? *oldest : std::vector<JobRow>()) {
      if (total > limit && evict(row)) {
        total -= std::min(total, row.film_bytes);
        goes_on = true;
      }
    }
  }
}

}  // namespace server
