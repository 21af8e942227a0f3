/// Error responses: application/problem+json (RFC 9457), in one form for the whole server.
#pragma once

#include <string_view>

#include "api/problem.h"
#include "server/http/message.h"

namespace server {

/// Returns the standard reason phrase, "" for an unknown status.
std::string_view reason_phrase(int status);

/// Adds Retry-After to 429 and 503. instance: the path of the request. Invalid UTF-8 is replaced by
/// U+FFFD.
Response problem_response(const api::Problem& problem, std::string_view instance);
/// The same for a status in api::error_table().
Response problem_response(int status, std::string_view detail, std::string_view instance);

/// For a request that needs a stream while all are taken.
Response no_stream_response(std::string_view instance);

}  // namespace server
