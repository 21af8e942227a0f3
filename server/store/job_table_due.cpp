// Jobs whose time is over, and films without a job.

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
  Statement select = session.prepare(
      "SELECT job FROM loose_films WHERE NOT EXISTS"
      " (SELECT 1 FROM jobs WHERE jobs.id=loose_films.job AND film<>2)");
  return first_column(select);
}

}  // namespace server
