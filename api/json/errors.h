/// Error codes, their HTTP status and their problem type: one table.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "api/problem.h"
#include "core/base/result.h"

namespace api {

struct ErrorRow {
  std::optional<core::ErrorCode> code;  ///< Empty: reported only by the HTTP layer.
  int status;
  std::string_view slug;   ///< the type is "/docs#problem-" + slug
  std::string_view title;  ///< short, the same for every problem of the type
};
std::span<const ErrorRow> error_table();
const ErrorRow& error_row(core::ErrorCode code);
/// Returns the HTTP status of a code.
int error_status(core::ErrorCode code);

/// Returns a problem without field errors.
Problem make_problem(core::ErrorCode code, std::string detail);
/// Uses the first row with that status. Pre: there is one.
Problem make_problem(int status, std::string detail);
/// Generates detail from the errors: the first one, and the number of others. Pre: not empty.
Problem make_problem(core::ErrorCode code, std::vector<FieldError> errors);
/// Converts an Error into a response. `where` becomes a field error if it is a JSON pointer
/// ("/..."); otherwise it is prepended to the message. kInternal keeps its message.
Problem from_error(const core::Error& error);

/// Returns the body, application/problem+json. instance: path of the request; empty keeps
/// problem.instance.
std::string problem_json(const Problem& problem, std::string_view instance);

}  // namespace api
