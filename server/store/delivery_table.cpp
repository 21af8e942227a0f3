#include "server/store/delivery_table.h"

#include "server/store/columns.h"

namespace server {

using core::Status;

namespace {

#define TESSERA_DELIVERY_COLUMNS                                                                 \
  "sequence, id, tenant, job, event, url, receiver, body, state, attempts, created_at, next_at," \
  " ended_at, status, detail"

core::Result<std::vector<DeliveryRow>> read_deliveries(Statement& select) {
  return select.rows([](const Statement& row) {
    return DeliveryRow{.sequence = row.integer(0),
                       .id = row.text(1),
                       .tenant = row.text(2),
                       .job = row.text(3),
                       .event = row.text(4),
                       .url = row.text(5),
                       .receiver = row.text(6),
                       .body = row.text(7),
                       .state = row.text(8),
                       .attempts = static_cast<int>(row.integer(9)),
                       .created_at = row.real(10),
                       .next_at = row.real(11),
                       .ended_at = row.optional_real(12),
                       .status = static_cast<int>(row.integer(13)),
                       .detail = row.text(14)};
  });
}

/// Returns tenant, scheme, host and port.
std::string receiver_of(const DeliveryRow& row) {
  const std::size_t scheme = row.url.find("://");
  const std::size_t host = scheme == std::string::npos ? 0 : scheme + 3;
  return row.tenant + " " + row.url.substr(0, row.url.find_first_of("/?", host));
}

core::Error unknown_delivery(std::string_view id) {
  return {core::ErrorCode::kNotFound, "no delivery has the id \"" + std::string(id) + "\"", ""};
}

}  // namespace

Status insert_deliveries(Database::Session& session, const std::vector<DeliveryRow>& rows) {
  for (const DeliveryRow& row : rows) {
    Statement insert = session.prepare(
        "INSERT INTO webhook_deliveries(id, tenant, job, event, url, receiver, body, state,"
        " attempts, created_at, next_at, status, detail) "
        "VALUES(?,?,?,?,?,?,?,'pending',0,?,?,0,'')");
    insert.bind(row.id).bind(row.tenant).bind(row.job).bind(row.event).bind(row.url);
    insert.bind(receiver_of(row)).bind(row.body).bind(row.created_at);
    if (auto status = insert.bind(row.next_at).run(); !status) {
      return status;
    }
  }
  return core::ok_status();
}

Status DeliveryTable::insert(const DeliveryRow& row) {
  return database_.transact(
      [&row](Database::Session& session) -> Status { return insert_deliveries(session, {row}); });
}

core::Result<std::vector<DeliveryRow>> DeliveryTable::due(double now, int receivers_of_tenant) {
  auto session = database_.session();
  Statement select = session.prepare(
      "SELECT " TESSERA_DELIVERY_COLUMNS
      " FROM (SELECT *, ROW_NUMBER() OVER"
      " (PARTITION BY tenant ORDER BY next_at, sequence) AS place"
      " FROM webhook_deliveries WHERE sequence IN"
      " (SELECT MIN(sequence) FROM webhook_deliveries AS d WHERE state='pending' AND next_at<=?1"
      "  AND NOT EXISTS (SELECT 1 FROM webhook_deliveries AS e WHERE e.job=d.job AND e.job<>''"
      "   AND e.url=d.url AND e.state='pending' AND e.sequence<d.sequence AND e.next_at>?1)"
      "  GROUP BY receiver)) WHERE place<=?2 ORDER BY next_at, sequence");
  return read_deliveries(select.bind(now).bind(std::int64_t{receivers_of_tenant}));
}

Status DeliveryTable::update(const DeliveryRow& row) {
  auto session = database_.session();
  Statement update = session.prepare(
      "UPDATE webhook_deliveries SET state=?, attempts=?, next_at=?, ended_at=?, status=?, detail=?"
      " WHERE id=?");
  update.bind(row.state).bind(std::int64_t{row.attempts}).bind(row.next_at).bind(row.ended_at);
  return update.bind(std::int64_t{row.status}).bind(row.detail).bind(row.id).run();
}

Status DeliveryTable::send_again(std::string_view id, const Access& access, double now) {
  if (const auto found = find(id, access); !found) {
    return found.error();
  }
  auto session = database_.session();
  Statement update = session.prepare(
      "UPDATE webhook_deliveries SET state='pending', attempts=0, next_at=?, ended_at=NULL"
      " WHERE id=?");
  return update.bind(now).bind(id).run();
}

Status DeliveryTable::bring_forward(int attempts, double now, double wait) {
  auto session = database_.session();
  Statement update = session.prepare(
      "UPDATE webhook_deliveries SET next_at=? WHERE state='pending' AND attempts=? AND next_at>?");
  return update.bind(now).bind(std::int64_t{attempts}).bind(now + wait).run();
}

core::Result<DeliveryRow> DeliveryTable::find(std::string_view id, const Access& access) {
  auto session = database_.session();
  Statement select =
      session.prepare("SELECT " TESSERA_DELIVERY_COLUMNS " FROM webhook_deliveries WHERE id=?");
  auto rows = read_deliveries(select.bind(id));
  if (!rows) {
    return rows.error();
  }
  if (rows->empty() || !access.sees(rows->front().tenant)) {
    return unknown_delivery(id);
  }
  return std::move(rows->front());
}

core::Result<std::vector<DeliveryRow>> DeliveryTable::list(const DeliveryQuery& query,
                                                           const Access& access) {
  auto session = database_.session();
  std::string sql = "SELECT " TESSERA_DELIVERY_COLUMNS " FROM webhook_deliveries WHERE 1";
  sql += access.sees_all() ? "" : " AND tenant=?";
  sql += query.job.empty() ? "" : " AND job=?";
  sql += query.state.empty() ? "" : " AND state=?";
  sql += query.before ? " AND sequence<?" : "";
  sql += " ORDER BY sequence DESC LIMIT ?";
  Statement select = session.prepare(sql.c_str());
  if (!access.sees_all()) {
    select.bind(access.tenant);
  }
  if (!query.job.empty()) {
    select.bind(query.job);
  }
  if (!query.state.empty()) {
    select.bind(query.state);
  }
  if (query.before) {
    select.bind(*query.before);
  }
  return read_deliveries(select.bind(std::int64_t{query.limit}));
}

core::Result<std::int64_t> DeliveryTable::pending_count() {
  auto session = database_.session();
  Statement select =
      session.prepare("SELECT COUNT(*) FROM webhook_deliveries WHERE state='pending'");
  return first_integer(select);
}

Status DeliveryTable::forget_before(double ended_at) {
  auto session = database_.session();
  Statement forget =
      session.prepare("DELETE FROM webhook_deliveries WHERE state<>'pending' AND ended_at<?");
  return forget.bind(ended_at).run();
}

core::Result<std::string> DeliveryTable::secret(std::string_view tenant, const std::string& fresh) {
  auto session = database_.session();
  {
    Statement keep = session.prepare(
        "INSERT INTO webhook_secrets(tenant, secret) VALUES(?,?) ON CONFLICT(tenant) DO NOTHING");
    if (auto kept = keep.bind(tenant).bind(fresh).run(); !kept) {
      return kept.error();
    }
  }
  Statement select = session.prepare("SELECT secret FROM webhook_secrets WHERE tenant=?");
  std::string secret = select.bind(tenant).step() ? select.text(0) : std::string();
  return select.result(std::move(secret));
}

Status DeliveryTable::replace_secret(std::string_view tenant, std::string_view secret) {
  auto session = database_.session();
  Statement keep =
      session.prepare("INSERT OR REPLACE INTO webhook_secrets(tenant, secret) VALUES(?,?)");
  return keep.bind(tenant).bind(secret).run();
}

}  // namespace server
