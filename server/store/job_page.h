/// The statement behind a page of the list of jobs.
#pragma once

#include <string>
#include <string_view>

#include "server/store/job_table.h"

namespace server {

/// SELECT of these columns, newest first; its parameters are bound by bind_job_page().
std::string job_page_sql(const JobQuery& query, std::string_view columns);
void bind_job_page(Statement& select, const JobQuery& query);

}  // namespace server
