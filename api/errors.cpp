#include "api/errors.h"

#include <algorithm>
#include <array>

#include <nlohmann/json.hpp>

#include "api/json.h"
#include "api/limits.h"

namespace api {
namespace {

using core::ErrorCode;

constexpr std::array kErrors = {
    ErrorRow{ErrorCode::kBadSyntax, 400, "bad-syntax", "The request cannot be read"},
    ErrorRow{ErrorCode::kUnauthorized, 401, "unauthorized", "A valid key is needed"},
    ErrorRow{ErrorCode::kForbidden, 403, "forbidden", "This key may not do that"},
    ErrorRow{ErrorCode::kNotFound, 404, "not-found", "There is nothing here"},
    ErrorRow{ErrorCode::kNotAcceptable, 406, "not-acceptable", "No representation fits"},
    ErrorRow{ErrorCode::kConflict, 409, "conflict", "The state does not allow it"},
    ErrorRow{ErrorCode::kGone, 410, "gone", "It was here and has been removed"},
    ErrorRow{ErrorCode::kPreconditionFailed, 412, "precondition-failed",
             "It has changed in the meantime"},
    ErrorRow{ErrorCode::kTooLarge, 413, "too-large", "The request asks for too much"},
    ErrorRow{ErrorCode::kUnsupportedMedia, 415, "unsupported-media",
             "The media type is not supported"},
    ErrorRow{ErrorCode::kRangeNotSatisfiable, 416, "range-not-satisfiable",
             "The range is outside the content"},
    ErrorRow{ErrorCode::kMisdirected, 421, "misdirected", "This server does not go by that name"},
    ErrorRow{ErrorCode::kInvalidArgument, 422, "invalid-argument", "A value is not allowed"},
    ErrorRow{ErrorCode::kMissingFiles, 424, "missing-files",
             "Files that the scene names are missing"},
    ErrorRow{ErrorCode::kTooManyRequests, 429, "too-many-requests", "Too many requests"},
    ErrorRow{ErrorCode::kInternal, 500, "internal", "The server made a mistake"},
    ErrorRow{ErrorCode::kUnavailable, 503, "unavailable", "The server cannot answer now"},
    ErrorRow{ErrorCode::kNoSpace, 507, "no-space", "The disk is full"},
    ErrorRow{ErrorCode::kOverQuota, 507, "over-quota", "No more may be kept"},
    ErrorRow{ErrorCode::kCancelled, 409, "cancelled", "It was cancelled"},
};

}  // namespace

std::span<const ErrorRow> error_table() { return kErrors; }

const ErrorRow& error_row(ErrorCode code) {
  const auto* row = std::find_if(kErrors.begin(), kErrors.end(),
                                 [code](const ErrorRow& each) { return each.code == code; });
  CHECK(row != kErrors.end());
  return *row;
}

int error_status(ErrorCode code) { return error_row(code).status; }

Problem make_problem(ErrorCode code, std::string detail) {
  const ErrorRow& row = error_row(code);
  Problem problem;
  problem.status = row.status;
  problem.type = "/docs#problem-" + std::string(row.slug);
  problem.title = std::string(row.title);
  problem.detail = std::move(detail);
  return problem;
}

Problem make_problem(ErrorCode code, std::vector<FieldError> errors) {
  CHECK(!errors.empty());
  const std::string place = errors.front().pointer.empty() ? "The body" : errors.front().pointer;
  std::string detail = place + ": " + errors.front().detail;
  if (errors.size() > 1) {
    detail += " (and " + std::to_string(errors.size() - 1) + " more)";
  }
  Problem problem = make_problem(code, std::move(detail));
  problem.errors = std::move(errors);
  if (problem.errors.size() > static_cast<std::size_t>(limits::kErrorsShown)) {
    problem.errors.resize(static_cast<std::size_t>(limits::kErrorsShown));
  }
  return problem;
}

Problem from_error(const core::Error& error) {
  if (error.where.starts_with('/')) {
    Problem problem = make_problem(error.code, error.where + ": " + error.message);
    problem.errors = {{error.where, error.message}};
    return problem;
  }
  return make_problem(error.code,
                      error.where.empty() ? error.message : error.where + ": " + error.message);
}

std::string problem_json(const Problem& problem, std::string_view instance) {
  Json body = {{"type", problem.type},
               {"title", problem.title},
               {"status", problem.status},
               {"detail", problem.detail}};
  const std::string_view place = instance.empty() ? std::string_view(problem.instance) : instance;
  if (!place.empty()) {
    body["instance"] = place;
  }
  if (!problem.errors.empty()) {
    Json errors = Json::array();
    for (const FieldError& error : problem.errors) {
      errors.push_back({{"pointer", error.pointer}, {"detail", error.detail}});
    }
    body["errors"] = std::move(errors);
  }
  return dump(body);
}

}  // namespace api
