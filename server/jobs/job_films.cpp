// Films of jobs: reading them, checkpoints, eviction.

#include <algorithm>
#include <chrono>
#include <string_view>
#include <utility>

#include <fcntl.h>

#include "server/jobs/job_service.h"
#include "server/jobs/save_run.h"
#include "server/observe/clock.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLook{250};
/// A checkpoint costs at most this share of the time between two of them.
constexpr double kWriteShare = 20;
/// Of the interval: the rest is for the write itself, so that it is complete in time.
constexpr double kBegin = 0.8;
constexpr int kEvictAtATime = 16;
constexpr double kHousekeepingSeconds = 600;
constexpr double kForgetSeconds = 1;

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

core::Result<std::shared_ptr<const StoredFilm>> JobService::stored_film(const Job& job) {
  if (auto kept = job.kept_film()) {
    return kept;
  }
  const JobRecord record = job.record();
  if (record.film == FilmPlace::kEvicted) {
    return Error{ErrorCode::kGone, "the film was evicted to keep the disk below its limit", ""};
  }
  if (job.memory_only() || (api::is_final(record.view.state) && record.film == FilmPlace::kNone)) {
    return no_sample_yet();
  }
  using Made = SingleFlightCache<StoredFilm>::Made;
  auto stored = films_.get(film_key(job), [&]() -> core::Result<Made> {
    auto read = read_film(job, record);
    if (!read) {
      return read.error();
    }
    const std::uint64_t bytes = read->film->bytes();
    return Made{.value = std::make_shared<const StoredFilm>(*std::move(read)), .bytes = bytes};
  });
  return !stored && stored.error().code == ErrorCode::kGone ? tell_damage(job, stored.error())
                                                            : stored;
}

core::Result<StoredFilm> JobService::read_film(const Job& job, const JobRecord& record) {
  const std::string path = data_.film_path(job.id());
  const bool is_kept = api::is_final(record.view.state) && record.film == FilmPlace::kOnDisk;
  if (const auto there = open_file(path, O_RDONLY); !there) {
    return there.error().code != ErrorCode::kNotFound ? there.error()
           : is_kept ? Error{ErrorCode::kGone, "its file is not there", ""}
                     : no_sample_yet();
  }
  auto file = FilmFile::open(path);
  if (!file) {
    return file.error();
  }
  auto film = blank_film(record.view);
  const std::uint64_t bytes = film->bytes();
  const auto lease = memory_.take(bytes, "the film");
  if (!lease) {
    return lease.error();
  }
  auto restored = file->restore(*film);
  if (!restored) {
    return is_kept ? Error{ErrorCode::kGone, restored.error().message, ""} : restored.error();
  }
  const auto samples = static_cast<int>(film->sample_counts().max);
  if (record.view.state == api::JobState::kFinished && samples < record.view.progress.samples_max) {
    return Error{ErrorCode::kGone,
                 "it has " + std::to_string(samples) + " of " +
                     std::to_string(record.view.progress.samples_max) + " samples",
                 ""};
  }
  return StoredFilm{
      .film = with_lease(std::move(film), memory_.note({.bytes = bytes}, MemoryGate::Kind::kIdle)),
      .record = std::move(*restored)};
}

Error JobService::tell_damage(const Job& job, const Error& damage) {
  constexpr std::string_view kWords = "The stored film is lost or damaged";
  const auto found = find_any(job.id());
  const auto is_told = [&](const std::string& warning) { return warning.starts_with(kWords); };
  if (found && (*found)->sequence() == job.sequence()) {
    const Status told = change(
        **found,
        [&](JobRecord& record) -> Status {
          if (std::any_of(record.view.warnings.begin(), record.view.warnings.end(), is_told)) {
            return Error{ErrorCode::kCancelled, "", ""};
          }
          record.view.warnings.push_back(
              std::string(kWords) + " (" + damage.message +
              "). It is not rendered again by itself; the same job, submitted again, ends "
              "with the same film.");
          return core::ok_status();
        },
        {.unstored = Unstored::kInMemory});
    if (told) {
      log_.write(LogLevel::kError, "film_damaged", {{"job", job.id()}, {"detail", damage.message}});
    }
  }
  return Error{ErrorCode::kGone, "the stored film is lost or damaged: " + damage.message, ""};
}

core::Result<std::shared_ptr<const core::Film>> JobService::film(const Job& job) {
  std::shared_ptr<const core::Film> film;
  if (const auto run = job.run()) {
    film = run->film();
  } else {
    const auto stored = stored_film(job);
    if (!stored) {
      return stored.error();
    }
    film = (*stored)->film;
  }
  if (!has_samples(*film)) {
    return no_sample_yet();
  }
  return film;
}

std::vector<core::ConvergencePoint> JobService::points(const Job& job) {
  if (const auto run = job.run()) {
    return run->task().points();
  }
  const auto stored = stored_film(job);
  return stored ? (*stored)->record.points : std::vector<core::ConvergencePoint>();
}

void JobService::checkpoint_loop(const std::stop_token& stop) {
  core::Mutex mutex;
  core::CondVar never;
  auto kept_house = Clock::now();
  auto forgot = kept_house;
  while (!stop.stop_requested()) {
    {
      const core::MutexLock lock(mutex);
      never.wait_for(mutex, stop, kLook, [] { return false; });
    }
    if (book_.waits_for_memory()) {
      admit();  // A request may have given some back.
    }
    for (const JobPointer& job : book_.all()) {
      const auto run = job->run();
      if (stop.stop_requested() || !run || job->memory_only()) {
        continue;
      }
      const double interval =
          std::max(options_.checkpoint_seconds * kBegin, run->last_save_seconds() * kWriteShare);
      const auto now = Clock::now();
      const auto [last, is_new] = checkpointed_.emplace(job->id(), now);
      if (is_new || std::chrono::duration<double>(now - last->second).count() < interval) {
        continue;
      }
      checkpoint(job);
      last->second = Clock::now();
    }
    std::erase_if(checkpointed_, [this](const auto& entry) {
      const auto job = book_.find(entry.first);
      return !job || !job->run();
    });
    if (std::chrono::duration<double>(Clock::now() - forgot).count() > kForgetSeconds) {
      forgot = Clock::now();
      forget_expired();
      go_on_with_room();
    }
    if (std::chrono::duration<double>(Clock::now() - kept_house).count() > kHousekeepingSeconds) {
      kept_house = Clock::now();
      evict_films();
      static_cast<void>(table_.forget_keys_before(unix_now() - 24.0 * 3600));  // Next time, then.
    }
  }
}

void JobService::checkpoint(const JobPointer& job) {
  const auto run = job->run();
  if (!run || job->memory_only() || run->task().finished()) {
    return;  // Whoever ended it saves it.
  }
  if (const Status saved = save_run(*run, quota_, false, false); !saved) {
    metrics_.count(Counter::kCheckpointFailed);
    if (saved.error().code != ErrorCode::kNoSpace) {
      run->fail(saved.error());
    } else if (!job->waits_for_disk()) {
      static_cast<void>(pause_for_room(job, nullptr));  // One that has ended needs none.
    }
    return;
  }
  const Status noted = change(*job,
                              [&](JobRecord& record) -> Status {
                                if (api::is_final(record.view.state)) {
                                  return Error{ErrorCode::kCancelled, "", ""};
                                }
                                record.view.progress = progress_of(*run);
                                record.film = FilmPlace::kOnDisk;
                                record.film_bytes = run->file_bytes();
                                return core::ok_status();
                              },
                              {.unstored = Unstored::kInMemory});
  if (noted) {
    metrics_.count(Counter::kCheckpointWritten);
    log_.write(LogLevel::kDebug, "checkpoint",
               {{"job", job->id()}, {"seconds", run->last_save_seconds()}});
  }
}

void JobService::remove_loose_film(const std::string& id) {
  const Status removed = remove_file(data_.film_path(id));
  const Status forgotten = removed ? table_.forget_loose_film(id) : removed;
  if (!forgotten) {
    log_.write(LogLevel::kWarning, "loose_film_stays",
               {{"job", id}, {"detail", forgotten.error().message}});
  }
}

void JobService::remove_unused_film(Job& job) {
  const core::MutexLock changing(job.change_mutex());
  const JobRecord record = job.record();
  if (!job.memory_only() && !job.is_removed() && api::is_final(record.view.state) &&
      record.film == FilmPlace::kNone) {
    remove_loose_film(job.id());
  }
}

void JobService::remove_loose_films() {
  const auto loose = table_.loose_films();
  for (const std::string& id : loose ? *loose : std::vector<std::string>()) {
    remove_loose_film(id);
  }
}

bool JobService::evict_film(const JobRow& row) {
  const auto job = find(row.id, Access::operators());
  // Noted first: a file that stays behind when the process ends is removed at the next start.
  if (!job || !table_.note_loose_film(row.id)) {
    return false;
  }
  const Status evicted =
      change(**job,
             [](JobRecord& record) -> Status {
               if (!api::is_final(record.view.state) || record.film != FilmPlace::kOnDisk) {
                 return Error{ErrorCode::kConflict, "", ""};
               }
               record.film = FilmPlace::kEvicted;
               return core::ok_status();
             },
             // Before anybody can delete the job and give its id, and this file, to another one.
             {.unstored = Unstored::kRefused,
              .before_telling = [&](const JobRecord&) { remove_loose_film(row.id); }});
  if (!evicted) {
    return false;
  }
  films_.erase_prefix(film_key(**job));
  metrics_.count(Counter::kFilmEvicted);
  log_.write(LogLevel::kInfo, "film_evicted", {{"job", row.id}});
  return true;
}

void JobService::evict_films() {
  const std::uint64_t limit = quota_.limits().total_bytes;
  const auto stored = quota_.total();
  if (limit == 0 || !stored) {
    return;
  }
  std::uint64_t total = stored->asset_bytes + stored->film_bytes;
  bool goes_on = true;
  while (total > limit && goes_on) {
    const auto oldest = table_.films_oldest_first(kEvictAtATime);
    goes_on = false;
    for (const JobRow& row : oldest ? *oldest : std::vector<JobRow>()) {
      if (total > limit && evict_film(row)) {
        total -= std::min(total, row.film_bytes);
        goes_on = true;
      }
    }
  }
}

}  // namespace server
