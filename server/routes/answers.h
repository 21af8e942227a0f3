/// Responses shared by many routes: problems, list pages.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "api/problem.h"
#include "core/base/result.h"
#include "server/http/message.h"
#include "server/jobs/job_service.h"

namespace server {

/// Returns application/problem+json for this request; 429 and 503 carry Retry-After.
Response problem_answer(const Request& request, const api::Problem& problem);
Response error_answer(const Request& request, const core::Error& error);
Response error_answer(const Request& request, core::ErrorCode code, std::string detail);

/// Returns the job `{id}`. Problems: 404 if the request may see no such job; with needs_image also
/// if the job renders none.
api::Parsed<JobPointer> find_job(JobService& jobs, const Request& request,
                                 bool needs_image = false);

/// Returns the sequence before which the next page starts. Empty: not a valid cursor.
std::optional<std::int64_t> cursor_sequence(const std::string& cursor);
/// Returns a list page: JSON, and Link: rel="next" when there is more.
Response list_answer(const Request& request, std::string json,
                     const std::optional<std::string>& next);

}  // namespace server
