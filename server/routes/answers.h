/// Responses shared by many routes: problems, list pages.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "api/problem.h"
#include "core/base/result.h"
#include "server/http/message.h"
#include "server/jobs/job_service.h"

namespace server {

/// Returns application/problem+json for this request; 429 and 503 carry Retry-After.
Response problem_answer(const Request& request, const api::Problem& problem);
Response error_answer(const Request& request, const core::Error& error);
Response error_answer(const Request& request, core::ErrorCode code, std::string detail);

enum class Needs { kJob, kImage };

/// Returns the job `{id}`. Problems: 404 if the request may see no such job, or if the job renders
/// no image and one is needed.
api::Parsed<JobPointer> find_job(JobService& jobs, const Request& request, Needs needs);

/// Returns the job of an id; null for one that can only be of an asset. Errors: of
/// JobService::find().
core::Result<JobPointer> job_or_asset(JobService& jobs, const std::string& id,
                                      const Access& access);

api::Problem no_preset_problem(std::string_view name);
/// For a body that ended before its declared length.
core::Error body_cut_short();
/// Returns the header Idempotency-Key; empty if there is none. Errors: kBadSyntax.
core::Result<std::string> idempotency_key(const Request& request);

/// Returns the sequence before which a page starts; empty: at the newest row. Errors: kBadSyntax at
/// "/cursor".
core::Result<std::optional<std::int64_t>> page_start(const std::string& cursor);
/// Removes the row after the page, if there is one, and returns the cursor of the next page.
template <typename Row>
std::optional<std::string> next_page(std::vector<Row>& rows, int limit) {
  if (static_cast<int>(rows.size()) <= limit) {
    return std::nullopt;
  }
  rows.pop_back();
  return std::to_string(rows.back().sequence);
}
/// Returns a list page: JSON, and Link: rel="next" when there is more.
Response list_answer(const Request& request, std::string json,
                     const std::optional<std::string>& next);

}  // namespace server
