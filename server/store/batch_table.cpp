#include "server/store/batch_table.h"

#include "server/store/columns.h"

namespace server {

using core::Status;

namespace {

constexpr const char* kNoneUnfinished =
    " AND NOT EXISTS(SELECT 1 FROM batch_jobs JOIN jobs ON jobs.sequence=job"
    " WHERE batch=batches.sequence AND state NOT IN ('finished','failed','cancelled'))";

#define TESSERA_BATCH_COLUMNS "SELECT sequence, id, tenant, name, webhook, created_at FROM batches"

core::Result<std::vector<BatchRow>> read_batches(Statement& select) {
  return select.rows([](const Statement& row) {
    return BatchRow{.sequence = row.integer(0),
                    .id = row.text(1),
                    .tenant = row.text(2),
                    .name = row.text(3),
                    .webhook = row.text(4),
                    .created_at = row.real(5)};
  });
}

}  // namespace

Status BatchTable::insert(Database::Session& session, const BatchRow& row,
                          const std::vector<std::int64_t>& jobs,
                          const std::vector<std::string>& values) {
  Statement insert = session.prepare(
      "INSERT INTO batches(id, tenant, name, webhook, reported, created_at) VALUES(?,?,?,?,0,?)");
  insert.bind(row.id).bind(row.tenant).bind(row.name).bind(row.webhook).bind(row.created_at);
  if (auto status = insert.run(); !status) {
    return status;
  }
  const std::int64_t batch = session.last_row_id();
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    Statement add =
        session.prepare("INSERT INTO batch_jobs(job, batch, place, matrix_values) VALUES(?,?,?,?)");
    add.bind(jobs[i]).bind(batch).bind(static_cast<std::int64_t>(i)).bind(values[i]);
    if (auto status = add.run(); !status) {
      return status;
    }
  }
  return core::ok_status();
}

core::Result<BatchRow> BatchTable::find(std::string_view id, const Access& access) {
  auto session = database_.session();
  Statement select = session.prepare(TESSERA_BATCH_COLUMNS " WHERE id=?");
  select.bind(id);
  auto rows = read_batches(select);
  if (!rows) {
    return rows.error();
  }
  if (rows->empty() || !access.sees(rows->front().tenant)) {
    return core::Error{core::ErrorCode::kNotFound,
                       "no batch has the id \"" + std::string(id) + "\"", ""};
  }
  return std::move(rows->front());
}

core::Result<std::vector<BatchJobRow>> BatchTable::jobs(const BatchRow& batch) {
  auto session = database_.session();
  Statement select = session.prepare(
      "SELECT id, matrix_values FROM batch_jobs JOIN jobs ON sequence=job WHERE batch=? "
      "ORDER BY place");
  select.bind(batch.sequence);
  return select.rows(
      [](const Statement& row) { return BatchJobRow{.id = row.text(0), .values = row.text(1)}; });
}

core::Result<std::vector<std::string>> BatchTable::ids_beside(std::int64_t job) {
  auto session = database_.session();
  Statement select = session.prepare(
      "SELECT id FROM batch_jobs JOIN jobs ON sequence=job WHERE batch="
      "(SELECT batch FROM batch_jobs WHERE job=?) ORDER BY place");
  return first_column(select.bind(job));
}

core::Result<std::vector<BatchRow>> BatchTable::list(std::optional<std::int64_t> before, int limit,
                                                     const Access& access) {
  auto session = database_.session();
  const auto tenant = access.sees_all() ? std::nullopt : std::optional<std::string>(access.tenant);
  std::string sql = TESSERA_BATCH_COLUMNS " WHERE 1";
  sql += before ? " AND sequence<?" : "";
  sql += tenant ? " AND tenant=?" : "";
  sql += " ORDER BY sequence DESC LIMIT ?";
  Statement select = session.prepare(sql.c_str());
  if (before) {
    select.bind(*before);
  }
  if (tenant) {
    select.bind(*tenant);
  }
  select.bind(std::int64_t{limit});
  return read_batches(select);
}

core::Result<std::vector<BatchRow>> BatchTable::ended(const std::optional<std::string>& job) {
  auto session = database_.session();
  std::string sql = TESSERA_BATCH_COLUMNS " WHERE reported=0 AND webhook<>''";
  sql += job ? " AND sequence=(SELECT batch FROM batch_jobs JOIN jobs ON jobs.sequence=job WHERE "
               "jobs.id=?)"
             : "";
  sql += kNoneUnfinished;
  Statement select = session.prepare(sql.c_str());
  if (job) {
    select.bind(*job);
  }
  return read_batches(select);
}

Status BatchTable::report_end(const BatchRow& batch, const DeliveryRow& delivery) {
  return database_.transact([&](Database::Session& session) -> Status {
    Statement update =
        session.prepare("UPDATE batches SET reported=1 WHERE sequence=? AND reported=0");
    if (auto status = update.bind(batch.sequence).run(); !status) {
      return status;
    }
    return session.changes() == 0 ? core::ok_status() : insert_deliveries(session, {delivery});
  });
}

Status BatchTable::reopen(const BatchRow& batch) {
  return database_.transact([&](Database::Session& session) -> Status {
    return session.prepare("UPDATE batches SET reported=0 WHERE sequence=?")
        .bind(batch.sequence)
        .run();
  });
}

}  // namespace server
