/// Headers that restrict what browsers do with a response (RFC 6797, CSP level 3, Referrer Policy).
#pragma once

#include <string_view>

#include "server/http/message.h"

namespace server {

/// For the page and its scripts: resources from this server only, nothing inline, no framing.
inline constexpr std::string_view kPagePolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "font-src 'self'; connect-src 'self'; worker-src 'self'; manifest-src 'self'; "
    "base-uri 'none'; form-action 'self'; frame-ancestors 'none'";

/// Adds X-Content-Type-Options, Referrer-Policy and, unless the response has a policy, one that
/// allows nothing. tls_only: adds Strict-Transport-Security too.
void add_security_headers(Response& response, bool tls_only);

}  // namespace server
