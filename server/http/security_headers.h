/// Headers that restrict what browsers do with a response (RFC 6797, CSP level 3, Referrer Policy).
#pragma once

#include <string>
#include <string_view>

#include "server/http/message.h"

namespace server {

/// Returns the policy of the page and its scripts: resources from this server only, nothing inline.
/// ancestors: sources of pages that may frame it; "'none'" for no framing.
std::string page_policy(std::string_view ancestors);

/// Adds X-Content-Type-Options, Referrer-Policy and, unless the response has a policy, one that
/// allows nothing. tls_only: adds Strict-Transport-Security too.
void add_security_headers(Response& response, bool tls_only);

}  // namespace server
