/// Texts of settings: their files, host names and origins.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"

namespace server {

/// Splits at commas, and removes blanks around the parts and empty parts.
std::vector<std::string> split_commas(std::string_view text);

/// Returns the file's content, without a byte order mark. Errors: kInvalidArgument for a directory
/// and for a file that cannot be read to its end.
core::Result<std::string> read_settings_file(const std::string& path);

/// Returns a host name or address as it is compared with the header Host: in lower case, perhaps
/// with a port. Errors: kInvalidArgument for what no browser sends there.
core::Result<std::string> normal_host(std::string_view text);

/// Returns an origin as browsers send it: scheme, host and port in lower case, without the scheme's
/// default port (RFC 6454, 6.2). Errors: kInvalidArgument for what is no origin.
core::Result<std::string> normal_origin(std::string_view text);

}  // namespace server
