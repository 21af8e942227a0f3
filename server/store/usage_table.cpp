#include "server/store/usage_table.h"

namespace server {
namespace {

constexpr const char* kUsage = R"sql(
WITH tenants(name) AS (SELECT '' UNION SELECT tenant FROM keys UNION SELECT owner FROM job_owners
    UNION SELECT tenant FROM asset_tenants UNION SELECT tenant FROM scene_tenants
    UNION SELECT tenant FROM deleted_work UNION SELECT ?2),
  work(tenant, jobs, unfinished, cpu_seconds, film_bytes) AS (
    SELECT COALESCE(owner, ''), COUNT(*),
    SUM(state NOT IN ('finished','failed','cancelled')), SUM(cpu_seconds),
      SUM(CASE WHEN owner IS NULL THEN (film=1)*film_bytes ELSE stored_bytes END)
    FROM jobs LEFT JOIN job_owners ON job_owners.job=jobs.sequence GROUP BY 1)
SELECT name, COALESCE(work.jobs, 0), COALESCE(unfinished, 0),
  COALESCE(work.cpu_seconds, 0) + COALESCE(deleted_work.cpu_seconds, 0),
  COALESCE(deleted_work.jobs, 0),
  COALESCE(film_bytes, 0)
FROM tenants LEFT JOIN work ON work.tenant=name LEFT JOIN deleted_work ON deleted_work.tenant=name
WHERE ?1 OR name=?2 ORDER BY name
)sql";

}  // namespace

core::Result<std::vector<UsageRow>> UsageTable::list(const Access& access) {
  auto session = database_.session();
  Statement select = session.prepare(kUsage);
  select.bind(std::int64_t{access.sees_all() ? 1 : 0}).bind(access.tenant);
  return select.rows([](const Statement& row) {
    return UsageRow{.tenant = row.text(0),
                    .jobs = row.integer(1),
                    .unfinished_jobs = row.integer(2),
                    .cpu_seconds = row.real(3),
                    .deleted_jobs = row.integer(4),
                    .film_bytes = row.integer(5)};
  });
}

}  // namespace server
