// What of the jobs is due: their own end, webhooks, films without a job; and whose they are.

#include "server/store/job_table.h"

namespace server {

using core::Status;

namespace {

core::Result<std::vector<std::string>> first_column(Statement& select) {
  std::vector<std::string> ids;
  while (select.step()) {
    ids.push_back(select.text(0));
  }
  if (const auto status = select.status(); !status) {
    return status.error();
  }
  return ids;
}

}  // namespace

core::Result<std::vector<std::string>> JobTable::expired(double now, int limit) {
  auto session = database_.session();
  Statement select = session.prepare(
      "SELECT id FROM job_expiries JOIN jobs ON sequence=job WHERE delete_at<=?"
      " ORDER BY delete_at LIMIT ?");
  select.bind(now).bind(std::int64_t{limit});
  return first_column(select);
}

core::Result<std::vector<DeliveryRow>> JobTable::due_deliveries(double now, int limit) {
  auto session = database_.session();
  Statement select = session.prepare(
      "SELECT id, job, url, body, attempts, next_at FROM deliveries WHERE next_at<=?"
      " ORDER BY next_at LIMIT ?");
  select.bind(now).bind(std::int64_t{limit});
  std::vector<DeliveryRow> rows;
  while (select.step()) {
    rows.push_back(DeliveryRow{.id = select.text(0),
                               .job = select.text(1),
                               .url = select.text(2),
                               .body = select.text(3),
                               .attempts = static_cast<int>(select.integer(4)),
                               .next_at = select.real(5)});
  }
  if (const auto status = select.status(); !status) {
    return status.error();
  }
  return rows;
}

Status JobTable::postpone_delivery(std::string_view id, int attempts, double next_at) {
  auto session = database_.session();
  Statement update = session.prepare("UPDATE deliveries SET attempts=?, next_at=? WHERE id=?");
  return update.bind(std::int64_t{attempts}).bind(next_at).bind(id).run();
}

Status JobTable::remove_delivery(std::string_view id) {
  auto session = database_.session();
  return session.prepare("DELETE FROM deliveries WHERE id=?").bind(id).run();
}

Status JobTable::note_loose_film(std::string_view id) {
  auto session = database_.session();
  return session.prepare("INSERT OR IGNORE INTO loose_films(job) VALUES(?)").bind(id).run();
}

Status JobTable::forget_loose_film(std::string_view id) {
  auto session = database_.session();
  return session.prepare("DELETE FROM loose_films WHERE job=?").bind(id).run();
}

core::Result<std::vector<std::string>> JobTable::loose_films() {
  auto session = database_.session();
  Statement select =
      session.prepare("SELECT job FROM loose_films WHERE NOT EXISTS"
                      " (SELECT 1 FROM jobs WHERE jobs.id=loose_films.job AND film<>2)");
  return first_column(select);
}

core::Result<std::string> JobTable::owner_of(std::int64_t job_sequence) {
  auto session = database_.session();
  Statement select = session.prepare("SELECT owner FROM job_owners WHERE job=?");
  std::string owner = select.bind(job_sequence).step() ? select.text(0) : std::string();
  if (const auto status = select.status(); !status) {
    return status.error();
  }
  return owner;
}

}  // namespace server
