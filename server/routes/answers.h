/// Responses shared by many routes: problems, failed lookups, list pages.
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

/// Returns application/problem+json for this request; 429 and 503 carry Retry-After.
Response problem_answer(const Request& request, const api::Problem& problem);
Response error_answer(const Request& request, const core::Error& error);
Response error_answer(const Request& request, core::ErrorCode code, std::string detail);

/// Returns the job named by `{id}`, or a 404 when the request may see no such job.
std::variant<JobPointer, Response> find_job(JobService& jobs, const Request& request);

/// The same for requests of its image: a 404 too if the job renders none.
std::variant<JobPointer, Response> find_job_with_image(JobService& jobs, const Request& request);

/// Returns 422 if the query has any parameter.
std::optional<Response> refuse_query(const Request& request);

/// Returns the sequence before which the next page starts. Empty: not a valid cursor.
std::optional<std::int64_t> cursor_sequence(const std::string& cursor);
/// Returns a list page: JSON, and Link: rel="next" when there is more.
Response list_answer(const Request& request, std::string json,
                     const std::optional<std::string>& next);

}  // namespace server
