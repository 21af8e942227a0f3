/// JobRecord: what is known of a job and outlives the process; its states and their changes.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "api/job_view.h"
#include "core/base/result.h"
#include "core/film/film.h"
#include "server/store/job_table.h"

namespace server {

struct JobRecord {
  api::JobView view;  ///< progress: as last recorded
  std::int64_t sequence = 0;
  std::string tenant = {};  ///< Whose it is; empty: the operator's.
  FilmPlace film = FilmPlace::kNone;
  std::uint64_t film_bytes = 0;  ///< On the disk.
  std::optional<core::Error> failure;
};

/// queued -> loading -> rendering -> finished; paused from all of the first three and back to
/// queued or rendering; failed and cancelled from all that are not final. Queued again: a finished
/// job that is extended, a failed one that is retried, and what a server that was started anew
/// finds under way.
bool may_change(api::JobState from, api::JobState to);

/// An empty film for what is stored of the job.
std::shared_ptr<core::Film> blank_film(const api::JobView& view);

/// When a job has finished: did an error choose its samples? A count that was fixed beforehand and
/// goes beyond is a choice of its own.
void note_samples_by_error(api::JobView& view);

/// Those of `after` that `before` has not.
std::vector<std::string> new_warnings(const api::JobView& before, const api::JobView& after);

JobRow to_row(const JobRecord& record);
/// Errors: kInternal when the stored spec cannot be read.
core::Result<JobRecord> to_record(const JobRow& row);

/// Memory-only: such a job leaves no trace on the disk.
bool is_memory_only(const api::JobSpec& spec);

}  // namespace server
