/// SQL of a page of the list of jobs.
#pragma once

#include <string>
#include <string_view>

#include "server/store/job_table.h"

namespace server {

/// Returns a SELECT of these columns, newest first; bind_job_page() binds its parameters.
std::string job_page_sql(const JobQuery& query, std::string_view columns);
void bind_job_page(Statement& select, const JobQuery& query);

}  // namespace server
