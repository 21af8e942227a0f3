#include "server/store/job_page.h"

#include "core/base/text.h"

namespace server {

std::string job_title(std::string_view name, std::string_view scene) {
  return core::in_lower_case(name.empty() ? scene : name);
}

std::string job_page_sql(const JobQuery& query, std::string_view columns) {
  // Starts from the labels or titles: their tables are small and in the order of the jobs, so that
  // few other rows are read.
  const bool by_label = !query.labels.empty();
  const bool by_title = !by_label && !query.title.empty();
  const bool by_tenant = !by_label && !by_title && query.tenant;
  const std::string sequence = by_label || by_title || by_tenant ? "lead.job" : "sequence";
  std::string sql = "SELECT " + std::string(columns) + " FROM ";
  if (by_label) {
    sql += "job_labels AS lead CROSS JOIN jobs ON sequence=lead.job WHERE lead.name=?";
    sql += query.labels.front().second ? " AND lead.value=?" : "";
  } else if (by_title) {
    sql += "job_titles AS lead CROSS JOIN jobs ON sequence=lead.job WHERE instr(lead.title, ?)";
  } else if (by_tenant) {
    sql += "job_owners AS lead CROSS JOIN jobs ON sequence=lead.job WHERE lead.owner=?";
  } else {
    sql += "jobs WHERE 1";
  }
  for (std::size_t i = 1; i < query.labels.size(); ++i) {
    sql += " AND EXISTS (SELECT 1 FROM job_labels WHERE job=sequence AND name=?";
    sql += query.labels[i].second ? " AND value=?)" : ")";
  }
  if (by_label && !query.title.empty()) {
    sql += " AND EXISTS (SELECT 1 FROM job_titles WHERE job=sequence AND instr(title, ?))";
  }
  if (query.tenant && !by_tenant) {
    sql += " AND EXISTS (SELECT 1 FROM job_owners WHERE job_owners.job=sequence AND owner=?)";
  }
  for (std::size_t i = 0; i < query.states.size(); ++i) {
    sql += i == 0 ? " AND state IN (?" : ",?";
  }
  sql += query.states.empty() ? "" : ")";
  sql += query.before ? " AND " + sequence + "<?" : "";
  sql += " ORDER BY " + sequence + " DESC LIMIT ?";
  return sql;
}

void bind_job_page(Statement& select, const JobQuery& query) {
  for (const auto& [name, value] : query.labels) {
    select.bind(name);
    if (value) {
      select.bind(*value);
    }
  }
  if (!query.title.empty()) {
    select.bind(job_title(query.title, ""));
  }
  if (query.tenant) {
    select.bind(*query.tenant);
  }
  for (const std::string& state : query.states) {
    select.bind(state);
  }
  if (query.before) {
    select.bind(*query.before);
  }
  select.bind(std::int64_t{query.limit});
}

}  // namespace server
