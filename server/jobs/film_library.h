/// FilmLibrary: the films of jobs, being rendered or stored: a cache, its readers, and eviction.
#pragma once

#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/film/film.h"
#include "server/jobs/job.h"
#include "server/jobs/job_index.h"
#include "server/jobs/journal.h"
#include "server/observe/memory_gate.h"
#include "server/scenes/single_flight_cache.h"
#include "server/store/data_dir.h"
#include "server/store/film_file.h"
#include "server/store/storage_quota.h"

namespace server {

class FilmLibrary {
 public:
  /// All outlive it.
  struct Parts {
    JobTable& table;
    const DataDir& data;
    StorageQuota& quota;
    MemoryGate& memory;
    Log& log;
    Metrics& metrics;
    Journal& journal;
    JobIndex& index;
  };
  FilmLibrary(Parts parts, std::uint64_t cache_bytes)
      : parts_(parts), cache_(cache_bytes, SingleFlightCache<StoredFilm>::Oversized::kNotKept) {}

  /// The film as it is: being rendered, or stored. Errors: kConflict no sample yet; kGone evicted,
  /// lost or damaged.
  core::Result<std::shared_ptr<const core::Film>> film(const Job& job);
  /// The film of a job that has ended, which is not changed any more. Waits while it is being
  /// settled. Errors: of film(); kConflict while the job is not final; kUnavailable.
  core::Result<std::shared_ptr<const core::Film>> final_film(const Job& job,
                                                             const std::stop_token& stop);
  /// Empty before the first error estimate.
  std::vector<core::ConvergencePoint> points(const Job& job);
  /// A film that is not being rendered. Errors: of film().
  core::Result<std::shared_ptr<const StoredFilm>> stored(const Job& job);

  /// Keeps a film that is not changed any more: in the cache, or with a memory-only job.
  void keep(Job& job, std::shared_ptr<const core::Film> film, FilmRecord record);
  /// What the cache has of the job is not true any more.
  void drop(const Job& job) { cache_.erase_prefix(key_of(job)); }

  /// The job's film file, made if there is none. Errors: those of FilmFile::open(); kCancelled when
  /// the job was deleted.
  core::Result<FilmFile> open_film_file(Job& job);
  /// Writes the file of a job that is not known yet; settled when the job is stored. Bytes on the
  /// disk. Errors: of the store and the disk.
  core::Result<std::uint64_t> write_new(const std::string& id, const core::Film& film,
                                        const FilmRecord& record,
                                        const core::FilmSettings& settings);
  /// Removes a file that belongs to no job.
  void remove_loose(const std::string& id);
  /// Those that were being made or removed when the last process ended.
  void remove_all_loose();
  /// The file of a job that ended before it had a sample.
  void remove_unused(Job& job);

  /// Removes the oldest films until the disk has no more than it may.
  void evict();

  /// Drops a cached film without readers. False: there is none.
  bool drop_unused() { return cache_.drop_unused(); }
  std::uint64_t cached_bytes() const { return cache_.bytes(); }

 private:
  core::Result<StoredFilm> read(const Job& job, const JobRecord& record);
  /// Notes in the log and in the job, once, that its film is lost; the answer for who asks for it.
  core::Error report_damage(const Job& job, const core::Error& damage);
  bool evict(const JobRow& row);
  void drop_if_removed(const Job& job);
  /// In the cache. Other than the id of a job, it is never given twice.
  static std::string key_of(const Job& job) { return std::to_string(job.sequence()) + "."; }

  const Parts parts_;
  SingleFlightCache<StoredFilm> cache_;
};

}  // namespace server
