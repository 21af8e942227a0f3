#include "server/store/worker_table.h"

#include "server/store/columns.h"

namespace server {

core::Status WorkerTable::suspend(const std::string& worker) {
  return database_.transact([&](Database::Session& session) -> core::Status {
    Statement insert = session.prepare("INSERT OR IGNORE INTO suspended_workers(worker) VALUES(?)");
    if (auto inserted = insert.bind(worker).run(); !inserted) {
      return inserted;
    }
    return session
        .prepare(
            "DELETE FROM suspended_workers WHERE number NOT IN"
            " (SELECT number FROM suspended_workers ORDER BY number DESC LIMIT ?)")
        .bind(std::int64_t{most_})
        .run();
  });
}

core::Result<std::set<std::string>> WorkerTable::suspended() const {
  auto session = database_.session();
  Statement select = session.prepare("SELECT worker FROM suspended_workers");
  const auto workers = first_column(select);
  if (!workers) {
    return workers.error();
  }
  return std::set<std::string>(workers->begin(), workers->end());
}

}  // namespace server
