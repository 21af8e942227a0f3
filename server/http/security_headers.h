/// Headers that tell a browser what an answer may do (RFC 6797, CSP level 3, Referrer Policy).
#pragma once

#include <string_view>

#include "server/http/message.h"

namespace server {

/// For the page and its scripts: everything from this server, nothing inline, in no frame.
inline constexpr std::string_view kPagePolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "font-src 'self'; connect-src 'self'; worker-src 'self'; manifest-src 'self'; "
    "base-uri 'none'; form-action 'self'; frame-ancestors 'none'";

/// What every answer carries: X-Content-Type-Options, Referrer-Policy, and a policy that lets it do
/// nothing unless it has one already. tls_only: Strict-Transport-Security too.
void add_security_headers(Response& response, bool tls_only);

}  // namespace server
