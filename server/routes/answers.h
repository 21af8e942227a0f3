/// Responses that many routes give: problems, lookups that fail, pages of lists.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include "api/problem.h"
#include "core/base/result.h"
#include "server/http/message.h"
#include "server/jobs/job_service.h"

namespace server {

/// application/problem+json about this request; 429 and 503 carry Retry-After.
Response problem_answer(const Request& request, const api::Problem& problem);
Response error_answer(const Request& request, const core::Error& error);
Response error_answer(const Request& request, core::ErrorCode code, std::string detail);

/// The job that `{id}` names, or the answer that there is none that the request may see.
std::variant<JobPointer, Response> find_job(JobService& jobs, const Request& request);

/// 422 when the query has any parameter.
std::optional<Response> refuse_query(const Request& request);

/// A cursor is the sequence that the next page is before. Empty: not one of ours.
std::optional<std::int64_t> cursor_sequence(const std::string& cursor);
/// A list page: JSON, and Link: rel="next" when there is more.
Response list_answer(const Request& request, std::string json,
                     const std::optional<std::string>& next);

}  // namespace server
