/// Conversion of RFC 3339 times to and from seconds since 1970.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace api {

/// Accepts any offset; truncates to milliseconds. Second 60 is the next second. Returns empty if
/// the text is not an RFC 3339 time, or the date does not exist.
std::optional<double> parse_rfc3339(std::string_view text);
/// Returns UTC, "2026-01-31T12:00:00.500Z", always with three digits of the fraction, so that texts
/// sort by time. Years 0 to 9999; times beyond are clamped.
std::string rfc3339(double unix_seconds);
/// The same with as few digits as needed, for times of requests, which are repeated as they came.
std::string short_rfc3339(double unix_seconds);

}  // namespace api
