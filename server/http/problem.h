/// Answers that say what is wrong: application/problem+json (RFC 9457), of one shape for the whole
/// server.
#pragma once

#include <string_view>

#include "api/problem.h"
#include "server/http/message.h"

namespace server {

/// The standard reason phrase, "" for an unknown status.
std::string_view reason_phrase(int status);

/// 429 and 503 carry Retry-After; instance is the path of the request. Text that is not UTF-8 is
/// sent with U+FFFD in its place.
Response problem_response(const api::Problem& problem, std::string_view instance);
/// The same of a status that api::error_table() has.
Response problem_response(int status, std::string_view detail, std::string_view instance);

}  // namespace server
