#include "server/routes/answers.h"

#include "api/json/errors.h"
#include "api/json/limits.h"
#include "api/requests.h"
#include "core/base/file_names.h"
#include "server/http/problem.h"
#include "server/http/text.h"

namespace server {
Response problem_answer(const Request& request, const api::Problem& problem) {
  return problem_response(problem, request.path);
}

Response error_answer(const Request& request, const core::Error& error) {
  if (error.code == core::ErrorCode::kCancelled && request.stop_token().stop_requested()) {
    return error_answer(request, core::ErrorCode::kUnavailable, "the server is stopping");
  }
  return problem_answer(request, api::from_error(error));
}

Response error_answer(const Request& request, core::ErrorCode code, std::string detail) {
  return problem_answer(request, api::make_problem(code, std::move(detail)));
}

api::Parsed<JobPointer> find_job(JobService& jobs, const Request& request, Needs needs) {
  auto job = jobs.find(std::string(request.path_param("id")), request.access);
  if (!job) {
    return api::from_error(job.error());
  }
  if (needs == Needs::kImage && !(*job)->record().view.spec.has_image) {
    return api::make_problem(core::ErrorCode::kNotFound,
                             "the job renders no image: its film is null");
  }
  return *std::move(job);
}

core::Result<JobPointer> job_or_asset(JobService& jobs, const std::string& id,
                                      const Access& access) {
  return api::is_uuid(id) ? jobs.find(id, access) : JobPointer();
}

api::Problem no_preset_problem(std::string_view name) {
  return api::make_problem(core::ErrorCode::kNotFound,
                           "no preset has the name \"" + std::string(name) + "\"");
}

core::Error body_cut_short() { return {core::ErrorCode::kBadSyntax, "the body was cut short", ""}; }

core::Result<std::string> idempotency_key(const Request& request) {
  const auto key = request.header("Idempotency-Key");
  constexpr auto kMost = static_cast<std::size_t>(api::limits::kIdempotencyKeyBytes);
  if (key && (key->empty() || key->size() > kMost)) {
    return core::Error{core::ErrorCode::kBadSyntax,
                       "Idempotency-Key has " + std::to_string(key->size()) + " bytes; 1 to " +
                           std::to_string(kMost) + " are allowed",
                       ""};
  }
  return std::string(key.value_or(""));
}

core::Result<std::optional<std::int64_t>> page_start(const std::string& cursor) {
  if (cursor.empty()) {
    return std::optional<std::int64_t>();
  }
  const auto number = parse_decimal(cursor);
  if (!number || *number > static_cast<std::uint64_t>(INT64_MAX)) {
    return core::Error{core::ErrorCode::kBadSyntax, "invalid page cursor", "/cursor"};
  }
  return std::optional(static_cast<std::int64_t>(*number));
}

Response list_answer(const Request& request, std::string json,
                     const std::optional<std::string>& next) {
  Response response = json_response(200, std::move(json));
  response.compressible = true;
  if (next) {
    // Repeats the request with another cursor.
    std::string target = request.path + "?cursor=" + *next;
    for (const auto& [name, value] : request.query_params) {
      if (name != "cursor") {
        target += "&" + core::percent_encode(name) + "=" + core::percent_encode(value);
      }
    }
    response.headers.add("Link", "<" + target + ">; rel=\"next\"");
  }
  return response;
}

}  // namespace server
