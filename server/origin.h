/// Host names and origins (RFC 6454, 4), of settings and of requests.
#pragma once

#include <string>
#include <string_view>

#include "core/base/result.h"

namespace server {

/// Returns the name or address of a Host field; IPv6 addresses keep their brackets.
std::string_view without_port(std::string_view host);

/// Returns `name`, `address`, or either with `:port`, in lower case and without a final dot.
/// Errors: kInvalidArgument for anything else, such as an address with a scheme or a wildcard.
core::Result<std::string> parse_host(std::string_view text);

/// Returns `scheme://host` or `scheme://host:port`, in lower case, without the scheme's default
/// port and without a final slash: equal origins are equal texts.
/// Errors: kInvalidArgument for anything else, such as a path or another scheme than http(s).
core::Result<std::string> parse_origin(std::string_view text);

}  // namespace server
