// Jobs due for deletion, and films without a job.

#include <algorithm>
#include <limits>

#include "server/store/columns.h"
#include "server/store/job_table.h"

namespace server {

using core::Status;

namespace {

/// Records read before others get the database: some ten milliseconds.
constexpr std::int64_t kScannedAtATime = 1000;

}  // namespace

core::Result<std::vector<std::string>> JobTable::expired(double now, const Retention& retention,
                                                         int limit) {
  auto session = database_.session();
  const std::int64_t changes = session.total_changes();
  if (changes == none_due_.changes && retention == none_due_.retention && now < none_due_.until) {
    return std::vector<std::string>();
  }
  Statement own = session.prepare(
      "SELECT id FROM job_expiries JOIN jobs ON sequence=job WHERE delete_at<=?"
      " ORDER BY delete_at LIMIT ?");
  auto ids = first_column(own.bind(now).bind(std::int64_t{limit}));
  const auto add = [&](Statement& select) {
    auto more = first_column(select.bind(std::int64_t{limit}));
    if (!ids || !more) {
      ids = ids ? std::move(more) : std::move(ids);
      return;
    }
    ids->insert(ids->end(), more->begin(), more->end());
  };
  if (retention.seconds > 0) {
    Statement old =
        session.prepare("SELECT id FROM jobs WHERE finished_at<=? ORDER BY finished_at LIMIT ?");
    add(old.bind(now - retention.seconds));
  }
  if (retention.count > 0) {
    Statement beyond = session.prepare(
        "SELECT id FROM jobs WHERE finished_at <= (SELECT finished_at FROM jobs"
        " WHERE finished_at IS NOT NULL ORDER BY finished_at DESC LIMIT 1 OFFSET ?)"
        " ORDER BY finished_at LIMIT ?");
    add(beyond.bind(retention.count));
  }
  if (ids && ids->empty()) {
    Statement first = session.prepare(
        "SELECT min(delete_at),(SELECT min(finished_at) FROM jobs) FROM job_expiries");
    if (first.step()) {
      constexpr double kNever = std::numeric_limits<double>::infinity();
      const double oldest = first.optional_real(1).value_or(kNever);
      none_due_ = {.changes = changes,
                   .retention = retention,
                   .until = std::min(first.optional_real(0).value_or(kNever),
                                     retention.seconds > 0 ? oldest + retention.seconds : kNever)};
    }
  }
  return ids;
}

Status JobTable::note_loose_film(std::string_view id) {
  return database_.transact([&](Database::Session& session) {
    return session.prepare("INSERT OR IGNORE INTO loose_films(job) VALUES(?)").bind(id).run();
  });
}

Status JobTable::forget_loose_film(std::string_view id) {
  return database_.transact([&](Database::Session& session) {
    return session.prepare("DELETE FROM loose_films WHERE job=?").bind(id).run();
  });
}

core::Result<std::vector<std::string>> JobTable::with_text(std::string_view text) {
  const auto last = last_sequence();
  std::vector<std::string> ids;
  for (std::int64_t after = 0; last && after < *last; after += kScannedAtATime) {
    auto session = database_.session();
    Statement select = session.prepare(
        "SELECT id FROM jobs WHERE sequence>? AND sequence<=? AND instr(record, ?)");
    auto more = first_column(select.bind(after).bind(after + kScannedAtATime).bind(text));
    if (!more) {
      return more.error();
    }
    ids.insert(ids.end(), more->begin(), more->end());
  }
  return last ? core::Result<std::vector<std::string>>(std::move(ids)) : last.error();
}

core::Result<std::vector<std::string>> JobTable::loose_films() {
  auto session = database_.session();
  Statement select = session.prepare(
      "SELECT job FROM loose_films WHERE NOT EXISTS"
      " (SELECT 1 FROM jobs WHERE jobs.id=loose_films.job AND film=1)");
  return first_column(select);
}

}  // namespace server
