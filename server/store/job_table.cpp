#include "server/store/job_table.h"

#include <utility>

#include <zlib.h>

#include "server/store/columns.h"
#include "server/store/job_page.h"

namespace server {

using core::Status;

namespace {

constexpr const char* kInsert =
    "INSERT INTO jobs(id, state, scene, environment_asset, finished_at, film, film_bytes,"
    " cpu_seconds, record, record_crc, sequence) VALUES(?,?,?,?,?,?,?,?,?,?,?)";

// A column that is set is written to its indexes even if it has that value already, each of which
// is a page of the log: id, scene and environment never change, and the others change seldom.
constexpr const char* kUpdate =
    "UPDATE jobs SET cpu_seconds=?2, record=?3, record_crc=?4 WHERE sequence=?1";
constexpr const char* kUpdateState = "UPDATE jobs SET state=?2 WHERE sequence=?1 AND state<>?2";
constexpr const char* kUpdateEnd =
    "UPDATE jobs SET finished_at=?2 WHERE sequence=?1 AND finished_at IS NOT ?2";
constexpr const char* kUpdateFilm =
    "UPDATE jobs SET film=?2, film_bytes=?3 WHERE sequence=?1 AND (film, film_bytes)<>(?2, ?3)";

#define TESSERA_JOB_COLUMNS                                                                    \
  "sequence, id, state, scene, environment_asset, finished_at, film, film_bytes, cpu_seconds," \
  " record, record_crc,"                                                                       \
  " COALESCE((SELECT owner FROM job_owners WHERE job_owners.job=sequence), '')"

/// Of records of older schemas, until they change.
constexpr std::int64_t kNoCrc = -1;

std::int64_t crc_of(std::string_view text) {
  return static_cast<std::int64_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(text.data()), text.size()));
}

/// Jobs that render or may render again: a finished job with its film can be extended.
constexpr const char* kNeedsInputs =
    "(state NOT IN ('finished','failed','cancelled') OR (state='finished' AND film=1))";

std::int64_t signed_of(std::uint64_t value) { return static_cast<std::int64_t>(value); }
std::uint64_t unsigned_of(std::int64_t value) { return static_cast<std::uint64_t>(value); }

void bind_row(Statement& statement, const JobRow& row) {
  statement.bind(row.id).bind(row.state).bind(row.scene).bind(row.environment_asset);
  statement.bind(row.finished_at).bind(static_cast<std::int64_t>(row.film));
  statement.bind(signed_of(row.film_bytes)).bind(row.cpu_seconds);
  statement.bind(row.record).bind(crc_of(row.record));
}

JobRow read_row(const Statement& from) {
  JobRow row{.sequence = from.integer(0),
             .id = from.text(1),
             .state = from.text(2),
             .scene = from.text(3),
             .environment_asset = from.text(4),
             .finished_at = from.optional_real(5),
             .film = static_cast<FilmPlace>(from.integer(6)),
             .film_bytes = unsigned_of(from.integer(7)),
             .cpu_seconds = from.real(8),
             .record = from.text(9),
             .tenant = from.text(11)};
  const std::int64_t crc = from.integer(10);
  row.is_damaged = crc != kNoCrc && crc != crc_of(row.record);
  return row;
}

/// Writes the columns by which jobs are found.
Status write_place(Database::Session& session, const JobRow& row) {
  Statement state = session.prepare(kUpdateState);
  if (auto status = state.bind(row.sequence).bind(row.state).run(); !status) {
    return status;
  }
  Statement end = session.prepare(kUpdateEnd);
  if (auto status = end.bind(row.sequence).bind(row.finished_at).run(); !status) {
    return status;
  }
  Statement film = session.prepare(kUpdateFilm);
  film.bind(row.sequence).bind(static_cast<std::int64_t>(row.film));
  return film.bind(signed_of(row.film_bytes)).run();
}

Status write_labels(Database::Session& session, const JobRow& row) {
  std::map<std::string, std::string> known;
  Statement read = session.prepare("SELECT name, value FROM job_labels WHERE job=?");
  read.bind(row.sequence);
  while (read.step()) {
    known.emplace(read.text(0), read.text(1));
  }
  if (auto status = read.status(); !status || known == row.labels) {
    return status;
  }
  if (auto status = session.prepare("DELETE FROM job_labels WHERE job=?").bind(row.sequence).run();
      !status) {
    return status;
  }
  for (const auto& [name, value] : row.labels) {
    Statement insert = session.prepare("INSERT INTO job_labels(job, name, value) VALUES(?,?,?)");
    if (auto status = insert.bind(row.sequence).bind(name).bind(value).run(); !status) {
      return status;
    }
  }
  return core::ok_status();
}

Status write_title(Database::Session& session, const JobRow& row) {
  Statement keep = session.prepare(
      "INSERT INTO job_titles(job, title) VALUES(?,?) ON CONFLICT(job)"
      " DO UPDATE SET title=excluded.title WHERE title<>excluded.title");
  return keep.bind(row.sequence).bind(job_title(row.name, row.scene)).run();
}

Status write_events(Database::Session& session, std::int64_t job,
                    const std::vector<EventRow>& events) {
  for (const EventRow& event : events) {
    Statement insert =
        session.prepare("INSERT INTO events(job, stream, seq, type, data) VALUES(?,?,?,?,?)");
    insert.bind(job)
        .bind(event.stream)
        .bind(signed_of(event.seq))
        .bind(event.type)
        .bind(event.data);
    if (auto status = insert.run(); !status) {
      return status;
    }
  }
  return core::ok_status();
}

Status write_expiry(Database::Session& session, const JobRow& row) {
  if (!row.delete_at) {
    return session.prepare("DELETE FROM job_expiries WHERE job=?").bind(row.sequence).run();
  }
  Statement keep =
      session.prepare("INSERT OR REPLACE INTO job_expiries(job, delete_at) VALUES(?,?)");
  return keep.bind(row.sequence).bind(*row.delete_at).run();
}

/// Updates the bytes counted for the owner, if there is one: for an unfinished job, the most that
/// it may need.
Status write_stored_bytes(Database::Session& session, const JobRow& row) {
  const std::uint64_t bytes = row.film == FilmPlace::kOnDisk ? row.film_bytes : 0;
  Statement update = session.prepare(
      row.finished_at ? "UPDATE job_owners SET stored_bytes=?1 WHERE job=?2 AND stored_bytes<>?1"
                      : "UPDATE job_owners SET stored_bytes=MAX(reserved_bytes, ?1)"
                        " WHERE job=?2 AND stored_bytes<>MAX(reserved_bytes, ?1)");
  return update.bind(signed_of(bytes)).bind(row.sequence).run();
}

Status write_change(Database::Session& session, const JobRow& row,
                    const std::vector<EventRow>& events,
                    const std::vector<DeliveryRow>& deliveries) {
  Statement update = session.prepare(kUpdate);
  update.bind(row.sequence).bind(row.cpu_seconds).bind(row.record).bind(crc_of(row.record));
  if (auto status = update.run(); !status) {
    return status;
  }
  if (session.changes() == 0) {
    return core::ok_status();  // Deleted in the meantime.
  }
  for (const auto write :
       {&write_place, &write_labels, &write_title, &write_expiry, &write_stored_bytes}) {
    if (auto status = write(session, row); !status) {
      return status;
    }
  }
  if (auto status = insert_deliveries(session, deliveries); !status) {
    return status;
  }
  return write_events(session, row.sequence, events);
}

Status write_key(Database::Session& session, const IdempotencyRow& key) {
  Statement keep = session.prepare(
      "INSERT OR REPLACE INTO idempotency(key, body_hash, job, created_at) VALUES(?,?,?,?)");
  return keep.bind(key.key).bind(key.body_hash).bind(key.job).bind(key.created_at).run();
}

Status write_new(Database::Session& session, const JobTable::Insertion& job) {
  const JobRow& row = job.row;
  Statement insert = session.prepare(kInsert);
  bind_row(insert, row);
  if (auto status = insert.bind(row.sequence).run(); !status) {
    return status;
  }
  for (const auto write : {&write_labels, &write_title}) {
    if (auto status = write(session, row); !status) {
      return status;
    }
  }
  if (!row.tenant.empty()) {
    Statement own =
        session.prepare("INSERT INTO job_owners(job, owner, reserved_bytes) VALUES(?,?,?)");
    own.bind(row.sequence).bind(row.tenant).bind(signed_of(row.reserved_bytes));
    if (auto status = own.run(); !status) {
      return status;
    }
    if (auto status = write_stored_bytes(session, row); !status) {
      return status;
    }
  }
  Statement forget = session.prepare("DELETE FROM loose_films WHERE job=?");
  if (auto status = forget.bind(row.id).run(); !status) {
    return status;
  }
  if (auto status = insert_deliveries(session, job.deliveries); !status) {
    return status;
  }
  return write_events(session, row.sequence, job.events);
}

core::Result<std::vector<JobRow>> read_jobs(Statement& select) { return select.rows(read_row); }

/// Returns whether a job (of that tenant) needs the id in the column.
core::Result<bool> input_in_use(Database& database, const std::string& column, std::string_view id,
                                const std::optional<std::string>& tenant) {
  auto session = database.session();
  const std::string of_tenant =
      tenant ? " AND COALESCE((SELECT owner FROM job_owners WHERE job=sequence), '')=?" : "";
  const std::string sql =
      "SELECT 1 FROM jobs WHERE " + column + "=? AND " + kNeedsInputs + of_tenant + " LIMIT 1";
  Statement select = session.prepare(sql.c_str());
  select.bind(id);
  if (tenant) {
    select.bind(*tenant);
  }
  return has_row(select);
}

}  // namespace

core::Result<std::int64_t> JobTable::next_run() {
  std::int64_t run = 0;
  const Status done = database_.transact([&run](Database::Session& session) -> Status {
    Statement next = session.prepare(
        "INSERT INTO counters(name, value) VALUES('run', 1)"
        " ON CONFLICT(name) DO UPDATE SET value = value + 1 RETURNING value");
    while (next.step()) {
      run = next.integer(0);
    }
    return next.status();
  });
  if (!done) {
    return done.error();
  }
  return run;
}

core::Result<std::int64_t> JobTable::last_sequence() {
  auto session = database_.session();
  Statement select = session.prepare("SELECT seq FROM sqlite_sequence WHERE name='jobs'");
  return first_integer(select);
}

Status JobTable::insert(const JobRow& row, const std::vector<EventRow>& events,
                        const std::optional<IdempotencyRow>& key,
                        const std::vector<DeliveryRow>& deliveries) {
  return insert({Insertion{row, events, deliveries}}, key, {});
}

Status JobTable::insert(const std::vector<Insertion>& jobs,
                        const std::optional<IdempotencyRow>& key, const Beside& beside) {
  const auto work = [&](Database::Session& session) -> Status {
    for (const Insertion& job : jobs) {
      if (auto status = write_new(session, job); !status) {
        return status;
      }
    }
    if (key) {
      if (auto status = write_key(session, *key); !status) {
        return status;
      }
    }
    return beside ? beside(session) : core::ok_status();
  };
  return database_.transact(work, Database::Spend::kFreeSpace);
}

Status JobTable::update(const JobRow& row, const std::vector<EventRow>& events,
                        const std::vector<DeliveryRow>& deliveries) {
  return database_.transact(
      [&](Database::Session& session) { return write_change(session, row, events, deliveries); });
}

Status JobTable::update(const std::vector<Change>& changes) {
  return database_.transact([&](Database::Session& session) -> Status {
    for (const Change& change : changes) {
      if (auto status = write_change(session, change.row, change.events, change.deliveries);
          !status) {
        return status;
      }
    }
    return core::ok_status();
  });
}

core::Result<std::optional<JobRow>> JobTable::find(std::string_view id) {
  auto session = database_.session();
  Statement select = session.prepare("SELECT " TESSERA_JOB_COLUMNS " FROM jobs WHERE id=?");
  auto rows = read_jobs(select.bind(id));
  if (!rows) {
    return rows.error();
  }
  return rows->empty() ? std::optional<JobRow>() : std::optional<JobRow>(std::move(rows->front()));
}

core::Result<std::vector<JobRow>> JobTable::list(const JobQuery& query) {
  auto session = database_.session();
  Statement select = session.prepare(job_page_sql(query, TESSERA_JOB_COLUMNS).c_str());
  bind_job_page(select, query);
  return read_jobs(select);
}

core::Result<std::vector<JobRow>> JobTable::unfinished() {
  auto session = database_.session();
  Statement select =
      session.prepare("SELECT " TESSERA_JOB_COLUMNS
                      " FROM jobs WHERE state NOT IN ('finished','failed','cancelled')"
                      " ORDER BY sequence");
  return read_jobs(select);
}

Status JobTable::remove(std::string_view id) {
  return database_.transact([id](Database::Session& session) -> Status {
    if (auto status = session.prepare("DELETE FROM idempotency WHERE job=?").bind(id).run();
        !status) {
      return status;
    }
    if (auto status =
            session.prepare("INSERT OR IGNORE INTO loose_films(job) VALUES(?)").bind(id).run();
        !status) {
      return status;
    }
    return session.prepare("DELETE FROM jobs WHERE id=?").bind(id).run();
  });
}

core::Result<std::vector<JobRow>> JobTable::films_oldest_first(int limit) {
  auto session = database_.session();
  Statement select = session.prepare(
      "SELECT " TESSERA_JOB_COLUMNS
      " FROM jobs WHERE film=1 AND finished_at IS NOT NULL ORDER BY finished_at LIMIT ?");
  return read_jobs(select.bind(std::int64_t{limit}));
}

core::Result<std::vector<EventRow>> JobTable::events_after(std::int64_t job_sequence,
                                                           std::int64_t stream, std::uint64_t seq) {
  auto session = database_.session();
  Statement select = session.prepare(
      "SELECT stream, seq, type, data FROM events WHERE job=? AND (stream, seq) > (?, ?)"
      " ORDER BY stream, seq");
  select.bind(job_sequence).bind(stream).bind(signed_of(seq));
  return select.rows([](const Statement& row) {
    return EventRow{.stream = row.integer(0),
                    .seq = unsigned_of(row.integer(1)),
                    .type = row.text(2),
                    .data = row.text(3)};
  });
}

core::Result<bool> JobTable::knows_stream(std::int64_t job_sequence, std::int64_t stream) {
  auto session = database_.session();
  Statement select = session.prepare("SELECT 1 FROM events WHERE job=? AND stream=? LIMIT 1");
  return has_row(select.bind(job_sequence).bind(stream));
}

Status JobTable::insert_key(const IdempotencyRow& key) {
  return database_.transact(
      [&key](Database::Session& session) -> Status { return write_key(session, key); },
      Database::Spend::kFreeSpace);
}

core::Result<std::optional<IdempotencyRow>> JobTable::find_key(std::string_view key) {
  auto session = database_.session();
  Statement select =
      session.prepare("SELECT key, body_hash, job, created_at FROM idempotency WHERE key=?");
  select.bind(key);
  std::optional<IdempotencyRow> row;
  if (select.step()) {
    row = IdempotencyRow{.key = select.text(0),
                         .body_hash = select.text(1),
                         .job = select.text(2),
                         .created_at = select.real(3)};
  }
  return select.result(std::move(row));
}

Status JobTable::forget_keys_before(double created_at) {
  auto session = database_.session();
  // A client-chosen id, and the hash of a whole request, are kept as long as their job.
  Statement forget = session.prepare(
      "DELETE FROM idempotency WHERE created_at<?"
      " AND ((key NOT GLOB 'put *' AND key NOT GLOB 'content *')"
      " OR NOT EXISTS (SELECT 1 FROM jobs WHERE jobs.id=idempotency.job))");
  return forget.bind(created_at).run();
}

core::Result<bool> JobTable::scene_in_use(std::string_view scene,
                                          const std::optional<std::string>& tenant) {
  return input_in_use(database_, "scene", scene, tenant);
}

core::Result<bool> JobTable::environment_in_use(std::string_view asset,
                                                const std::optional<std::string>& tenant) {
  return input_in_use(database_, "environment_asset", asset, tenant);
}

core::Result<int> JobTable::unfinished_of(std::string_view tenant) {
  auto session = database_.session();
  // Selects by state first: a tenant may have many jobs, but few jobs are unfinished.
  Statement select = session.prepare(
      "SELECT COUNT(*) FROM jobs CROSS JOIN job_owners ON job=sequence"
      " WHERE state IN ('queued','loading','rendering','paused') AND owner=?");
  const int count = select.bind(tenant).step() ? static_cast<int>(select.integer(0)) : 0;
  return select.result(count);
}

core::Result<std::map<std::string, std::int64_t>> JobTable::count_by_state() {
  auto session = database_.session();
  Statement select = session.prepare("SELECT state, COUNT(*) FROM jobs GROUP BY state");
  std::map<std::string, std::int64_t> counts;
  while (select.step()) {
    counts[select.text(0)] = select.integer(1);
  }
  return select.result(std::move(counts));
}

}  // namespace server
