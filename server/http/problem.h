/// The few problem documents (RFC 9457) that the transport makes by itself.
#pragma once

#include <string>
#include <string_view>

#include "server/http/message.h"

namespace server {

/// The standard reason phrase, "" for an unknown status.
std::string_view reason_phrase(int status);

/// `{"type":"about:blank","title":...,"status":...,"detail":...,"instance":...}`. detail and
/// instance may hold any bytes; what is not UTF-8 becomes U+FFFD. An empty instance is left out.
std::string problem_json(int status, std::string_view detail, std::string_view instance);

/// application/problem+json with that text; instance is the path of the request.
Response problem_response(int status, std::string_view detail, std::string_view instance);

}  // namespace server
