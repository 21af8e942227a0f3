/// JobTable: job records, their labels, durable events and idempotency keys.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "server/store/database.h"
#include "server/store/delivery_table.h"

namespace server {

/// Location of a job's film.
enum class FilmPlace { kNone = 0, kOnDisk = 1, kEvicted = 2 };

/// A job as stored in the database: what queries need in columns of their own, and all of it in one
/// document. Times are seconds since 1970; states are the words of the API.
struct JobRow {
  std::int64_t sequence = 0;  ///< The newest has the highest.
  std::string id;
  std::string state;
  std::string scene = {};
  std::string environment_asset = {};  ///< Empty: none.
  std::optional<double> finished_at = {};
  FilmPlace film = FilmPlace::kNone;
  std::uint64_t film_bytes = 0;
  double cpu_seconds = 0;
  std::string record = {};  ///< JSON text, by job_record.h.
  bool is_damaged = false;  ///< A bit of the record was changed since it was written.
  std::string tenant = {};  ///< The owner; empty: the operator. Never changes.

  // Not read back: they follow from the record and the request. insert() writes no expiry, since a
  // new job has not ended.
  std::string name = {};  ///< Title for searches.
  std::map<std::string, std::string> labels = {};
  std::uint64_t reserved_bytes = 0;      ///< The largest size of its film file. insert() only.
  std::optional<double> delete_at = {};  ///< When it expires.
};

/// A durable event. (stream, seq) grows within a job; stream is the number of the server's run.
struct EventRow {
  std::int64_t stream = 0;
  std::uint64_t seq = 0;
  std::string type;
  std::string data;
};

struct IdempotencyRow {
  std::string key;
  std::string body_hash;
  std::string job;
  double created_at = 0;
};

/// Returns the text that a job is searched by: its name, or its scene if it has none, with A to Z
/// in lower case.
std::string job_title(std::string_view name, std::string_view scene);

struct JobQuery {
  std::vector<std::string> states;  ///< Any of these; empty: all.
  /// All of these; without a value, only the name has to match.
  std::vector<std::pair<std::string, std::optional<std::string>>> labels;
  std::string title = {};                  ///< A part of job_title(), ignoring case; empty: all.
  std::optional<std::string> tenant = {};  ///< The owner; empty: all tenants.
  bool stored = true;                  ///< Includes jobs of class normal, which this table stores.
  bool previews = true;                ///< Includes previews, which are only in memory.
  std::optional<std::int64_t> before;  ///< Only sequences below.
  int limit = 50;
};

class JobTable {
 public:
  /// database must outlive this.
  explicit JobTable(Database& database) : database_(database) {}
  Database& database() { return database_; }

  /// Returns the number of this run of the server, one above the previous one's.
  core::Result<std::int64_t> next_run();

  /// Returns the highest sequence ever given to a job.
  core::Result<std::int64_t> last_sequence();

  /// Inserts record, first events and key; all or nothing.
  core::Status insert(const JobRow& row, const std::vector<EventRow>& events,
                      const std::optional<IdempotencyRow>& key,
                      const std::vector<DeliveryRow>& deliveries = {});
  /// A batch: its jobs, the batch and its key; all are inserted or none.
  struct Insertion {
    JobRow row;
    std::vector<EventRow> events;
    std::vector<DeliveryRow> deliveries;
  };
  using Beside = std::function<core::Status(Database::Session&)>;
  core::Status insert(const std::vector<Insertion>& jobs, const std::optional<IdempotencyRow>& key,
                      const Beside& beside);
  /// Replaces everything but the identity, and adds the events and webhook calls.
  core::Status update(const JobRow& row, const std::vector<EventRow>& events,
                      const std::vector<DeliveryRow>& deliveries = {});
  /// One of several changes, all of which are made or none.
  struct Change {
    JobRow row;
    std::vector<EventRow> events;
    std::vector<DeliveryRow> deliveries;
  };
  core::Status update(const std::vector<Change>& changes);
  core::Result<std::optional<JobRow>> find(std::string_view id);
  /// Returns jobs, newest first.
  core::Result<std::vector<JobRow>> list(const JobQuery& query);
  /// Returns the ids of the jobs whose records contain the text. Reads all records.
  core::Result<std::vector<std::string>> with_text(std::string_view text);
  /// Returns unfinished jobs, oldest first.
  core::Result<std::vector<JobRow>> unfinished();
  /// Removes the job; its film is loose from then on.
  core::Status remove(std::string_view id);
  /// Records a film file that will be created before its job is inserted, which claims it, or that
  /// will be removed.
  core::Status note_loose_film(std::string_view id);
  core::Status forget_loose_film(std::string_view id);
  /// Returns film files without a job, or of a job whose film was evicted or forgotten: their
  /// creation or removal was interrupted when a process ended.
  core::Result<std::vector<std::string>> loose_films();
  /// Returns ended jobs whose film is on disk, oldest first.
  core::Result<std::vector<JobRow>> films_oldest_first(int limit);

  /// Returns the events after (stream, seq), in order.
  core::Result<std::vector<EventRow>> events_after(std::int64_t job_sequence, std::int64_t stream,
                                                   std::uint64_t seq);
  /// Returns whether that run of the server stored events of the job.
  core::Result<bool> knows_stream(std::int64_t job_sequence, std::int64_t stream);

  /// Inserts a key of a job that is not stored itself.
  core::Status insert_key(const IdempotencyRow& key);
  core::Result<std::optional<IdempotencyRow>> find_key(std::string_view key);
  core::Status forget_keys_before(double created_at);

  /// Returns the number of the tenant's unfinished jobs.
  core::Result<int> unfinished_of(std::string_view tenant);
  /// Maximum age and number of ended jobs that are kept; 0: no limit.
  struct Retention {
    double seconds = 0;
    std::int64_t count = 0;
    friend bool operator==(const Retention&, const Retention&) = default;
  };
  /// Returns ids of jobs to delete: by their own expiry, or by `retention`. While nothing is stored
  /// and none is due, it does not ask the database.
  core::Result<std::vector<std::string>> expired(double now, const Retention& retention, int limit);

  /// Return whether jobs need the scene or asset: unfinished ones, and finished ones that can be
  /// extended. tenant: only jobs of that tenant; empty: all.
  core::Result<bool> scene_in_use(std::string_view scene, const std::optional<std::string>& tenant);
  core::Result<bool> environment_in_use(std::string_view asset,
                                        const std::optional<std::string>& tenant);

  core::Result<std::map<std::string, std::int64_t>> count_by_state();

 private:
  /// The last answer of expired(), if it was empty. Read and written in a session.
  struct NoneDue {
    std::int64_t changes = -1;  ///< of the database until then
    Retention retention;
    double until = 0;
  };

  Database& database_;
  NoneDue none_due_;
};

}  // namespace server
