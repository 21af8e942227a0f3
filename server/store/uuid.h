/// Identifiers of jobs and comparisons.
#pragma once

#include <string>

namespace server {

/// Returns a random UUID (RFC 9562, version 4).
std::string make_uuid();

}  // namespace server
