/// RFC 3339 times to and from seconds since 1970.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace api {

/// Any offset; to the millisecond, further digits are cut. Second 60 is the next second. Empty if
/// the text is not an RFC 3339 time; dates that do not exist are none either.
std::optional<double> parse_rfc3339(std::string_view text);
/// UTC, "2026-01-31T12:00:00.5Z"; as many digits of the fraction as are needed, at most three.
/// Years 0 to 9999; what is beyond is shown as the nearest end.
std::string rfc3339(double unix_seconds);

}  // namespace api
