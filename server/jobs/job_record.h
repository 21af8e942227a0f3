/// JobRecord: the persistent state of a job; job states and their transitions.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "api/answers/job_view.h"
#include "core/base/result.h"
#include "core/film/film.h"
#include "server/store/job_table.h"

namespace server {

struct JobRecord {
  api::JobView view;  ///< progress: as last recorded
  std::int64_t sequence = 0;
  std::string tenant = {};  ///< The owner; empty: the operator.
  FilmPlace film = FilmPlace::kNone;
  std::uint64_t film_bytes = 0;  ///< On disk, with its file of first images.
  std::optional<core::Error> failure;
  std::set<std::string> unverified;  ///< Workers with unverified results in the film.
};

/// Marks an ended job as doubted, with a warning that says what helps.
void doubt(api::JobView& view);
/// Returns whether the job can be rendered anew because it is doubted.
bool can_begin_again(const api::JobView& view);

/// Forgets the job's samples, and that they were doubted. The film remains to be removed.
void forget_samples(JobRecord& record);

/// queued -> loading -> rendering -> finished; paused from the first three and back to queued or
/// rendering; failed and cancelled from all that are not final. Queued again: a finished job that
/// is extended, a failed one that is retried, and unfinished jobs after a restart of the server.
bool may_change(api::JobState from, api::JobState to);

/// Returns an empty film with the stored settings of the job.
std::shared_ptr<core::Film> blank_film(const api::JobView& view);

/// Records, when a job has finished, whether an error estimate chose its number of samples. A
/// larger count that was fixed beforehand does not depend on it.
void note_samples_by_error(api::JobView& view);

/// Returns the warnings of `after` that `before` does not have.
std::vector<std::string> new_warnings(const api::JobView& before, const api::JobView& after);

JobRow to_row(const JobRecord& record);
/// Returns how rows name a worker.
std::string text_of_worker(const std::string& worker);
/// Errors: kInternal when the record is damaged or cannot be read.
core::Result<JobRecord> to_record(const JobRow& row);
/// Returns whether the error of a job's record is that of to_record(): it stays, unlike failures of
/// the machine.
bool is_damaged(const core::Error& error, std::string_view id);

/// Returns whether the job is memory-only and leaves nothing on disk.
bool is_memory_only(const api::JobSpec& spec);

}  // namespace server
