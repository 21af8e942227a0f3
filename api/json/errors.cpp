#include "api/json/errors.h"

#include <algorithm>
#include <array>

#include <nlohmann/json.hpp>

#include "api/answers/views.h"
#include "api/json/error_codes.h"
#include "api/json/json.h"
#include "api/json/limits.h"
#include "api/json/values.h"

namespace api {
namespace {

using core::ErrorCode;

/// Longest text of a problem: input that it quotes is cut. The lists of names in our messages are
/// shorter (missing_files() in core/scene_io).
constexpr std::size_t kTextBytes = 4096;

constexpr std::array kErrors = {
    ErrorRow{ErrorCode::kBadSyntax, 400, "bad-syntax", "Malformed request"},
    ErrorRow{kUnauthorized, 401, "unauthorized", "Access key required"},
    ErrorRow{ErrorCode::kForbidden, 403, "forbidden", "Not allowed for this access key"},
    ErrorRow{kForeignOrigin, 403, "foreign-origin", "Not allowed for pages of this origin"},
    ErrorRow{ErrorCode::kNotFound, 404, "not-found", "Not found"},
    ErrorRow{std::nullopt, 405, "method-not-allowed", "Method not allowed"},
    ErrorRow{kNotAcceptable, 406, "not-acceptable", "No acceptable representation"},
    ErrorRow{std::nullopt, 408, "timeout", "Request timed out"},
    ErrorRow{ErrorCode::kConflict, 409, "conflict", "Not allowed in the current state"},
    ErrorRow{kGone, 410, "gone", "Gone: the resource has been removed"},
    ErrorRow{kPreconditionFailed, 412, "precondition-failed", "Changed in the meantime"},
    ErrorRow{ErrorCode::kTooLarge, 413, "too-large", "Request too large"},
    ErrorRow{std::nullopt, 414, "target-too-long", "Request target too long"},
    ErrorRow{ErrorCode::kUnsupportedFormat, 415, "unsupported-media", "Unsupported media type"},
    ErrorRow{kRangeNotSatisfiable, 416, "range-not-satisfiable", "Range not satisfiable"},
    ErrorRow{std::nullopt, 417, "expectation-failed", "Expectation failed"},
    ErrorRow{kMisdirected, 421, "misdirected", "Unknown host name"},
    ErrorRow{ErrorCode::kInvalidArgument, 422, "invalid-argument", "Invalid value"},
    ErrorRow{ErrorCode::kMissingFiles, 424, "missing-files", "Missing scene files"},
    ErrorRow{kTooManyRequests, 429, "too-many-requests", "Too many requests"},
    ErrorRow{std::nullopt, 431, "headers-too-long", "Headers too long"},
    ErrorRow{ErrorCode::kInternal, 500, "internal", "Internal server error"},
    ErrorRow{std::nullopt, 501, "not-implemented", "Transfer coding not supported"},
    ErrorRow{ErrorCode::kUnavailable, 503, "unavailable", "Service unavailable"},
    ErrorRow{std::nullopt, 505, "wrong-version", "HTTP version not supported"},
    ErrorRow{ErrorCode::kNoSpace, 507, "no-space", "Disk full"},
    ErrorRow{kOverQuota, 507, "over-quota", "Storage quota exceeded"},
    ErrorRow{ErrorCode::kCancelled, 409, "cancelled", "Cancelled"},
};

Problem make_problem(const ErrorRow& row, std::string detail) {
  Problem problem;
  problem.status = row.status;
  problem.type = "/docs#problem-" + std::string(row.slug);
  problem.title = std::string(row.title);
  problem.detail = std::move(detail);
  return problem;
}

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
  return make_problem(error_row(code), std::move(detail));
}

Problem make_problem(int status, std::string detail) {
  const auto* row = std::find_if(kErrors.begin(), kErrors.end(),
                                 [status](const ErrorRow& each) { return each.status == status; });
  CHECK(row != kErrors.end());
  return make_problem(*row, std::move(detail));
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
  // `where` of these is a path on the server, which clients must not see.
  if (error.code == ErrorCode::kNoSpace || error.code == ErrorCode::kInternal) {
    return make_problem(error.code, error.message);
  }
  if (error.where.starts_with('/')) {
    Problem problem = make_problem(error.code, error.where + ": " + error.message);
    problem.errors = {{error.where, error.message}};
    return problem;
  }
  return make_problem(error.code,
                      error.where.empty() ? error.message : error.where + ": " + error.message);
}

const View<FieldError>& field_error_view() {
  static const View<FieldError> kView = {
      "FieldError",
      "One error of the input.",
      {{"pointer", shape::text("JSON pointer into the body; /name for the query parameter `name`."),
        [](const FieldError& e) -> Json { return cut_text(e.pointer, kTextBytes); }},
       {"detail", shape::text("What was found and what is allowed."),
        [](const FieldError& e) -> Json { return cut_text(e.detail, kTextBytes); }}}};
  return kView;
}

const View<Problem>& problem_view() {
  static const View<Problem> kView = {
      "Problem",
      "RFC 9457.",
      {{"type", shape::text("Type of problem, a URI reference."), Member<&Problem::type>::json},
       {"title", shape::text("Same for every problem of the type."), Member<&Problem::title>::json},
       {"status", shape::count("HTTP status."), Member<&Problem::status>::json},
       {"detail", shape::text("About this problem."),
        [](const Problem& p) -> Json { return cut_text(p.detail, kTextBytes); }},
       {"instance", shape::text("URL path of the request."), Member<&Problem::instance>::json,
        [](const Problem& p) { return !p.instance.empty(); }},
       {"errors", shape::list(field_error_view().shape(), "Errors of the input."),
        [](const Problem& p) { return print_list(field_error_view(), p.errors); },
        [](const Problem& p) { return !p.errors.empty(); }}}};
  return kView;
}

std::string problem_json(const Problem& problem, std::string_view instance) {
  if (instance.empty()) {
    return dump(problem_view().print(problem));
  }
  Problem placed = problem;
  placed.instance = instance;
  return dump(problem_view().print(placed));
}

}  // namespace api
