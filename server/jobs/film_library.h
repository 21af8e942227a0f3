/// FilmLibrary: films of jobs, rendering or stored. Caches them, serves readers, evicts old ones.
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
  /// All members must outlive it.
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

  /// Returns the current film, rendering or stored. Errors: kConflict when it has no sample yet;
  /// kGone when evicted, lost or damaged.
  core::Result<std::shared_ptr<const core::Film>> film(const Job& job);
  /// Returns the final film of a finished job. Waits while it is being saved. Errors: of film();
  /// kConflict while the job is not final; kUnavailable.
  core::Result<std::shared_ptr<const core::Film>> final_film(const Job& job,
                                                             const std::stop_token& stop);
  /// Returns the convergence points; empty before the first error estimate.
  std::vector<core::ConvergencePoint> points(const Job& job);
  /// Returns a film that is not being rendered. Errors: of film().
  core::Result<std::shared_ptr<const StoredFilm>> stored(const Job& job);

  /// Stores a final film: in the cache, or with a memory-only job.
  void keep(Job& job, std::shared_ptr<const core::Film> film, FilmRecord record);
  /// Invalidates the job's cache entry.
  void drop(const Job& job) { cache_.erase_prefix(key_of(job)); }

  /// Opens the job's film file, creating it if needed. Errors: of FilmFile::open(); kCancelled when
  /// the job was deleted.
  core::Result<FilmFile> open_film_file(Job& job);
  /// Writes the film file of a job that is not stored yet; storing the job claims the file. Returns
  /// its bytes on disk. Errors: of the store and the disk.
  core::Result<std::uint64_t> write_new(const std::string& id, const core::Film& film,
                                        const FilmRecord& record,
                                        const core::FilmSettings& settings);
  /// Removes a file that belongs to no job.
  void remove_loose(const std::string& id);
  /// Removes files whose creation or removal the previous process did not complete.
  void remove_all_loose();
  /// Removes the film of a job whose samples are forgotten (forget_samples()). Call the first
  /// before that is committed, the second after it, with the job's change_mutex() held: if the
  /// process ends in between, the next start removes the film.
  core::Status announce_removal(const Job& job);
  void remove_forgotten(const Job& job);
  /// Removes the file of a job that ended before it had a sample.
  void remove_unused(Job& job);

  /// Evicts the oldest films until the disk limit holds.
  void evict();

  /// Drops a cached film without readers. Returns false when there is none.
  bool drop_unused() { return cache_.drop_unused(); }
  std::uint64_t cached_bytes() const { return cache_.bytes(); }

 private:
  core::Result<StoredFilm> read(const Job& job, const JobRecord& record);
  /// Records once, in the log and in the job, that its film is lost. Returns the error for callers.
  core::Error report_damage(const Job& job, const core::Error& damage);
  bool evict(const JobRow& row);
  void drop_if_removed(const Job& job);
  /// Key in the cache. Unlike a job id, it is never reused.
  static std::string key_of(const Job& job) { return std::to_string(job.sequence()) + "."; }

  const Parts parts_;
  SingleFlightCache<StoredFilm> cache_;
};

}  // namespace server
