/// Lexical rules of HTTP (RFC 9110 section 5.6), and percent-decoding.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/text.h"

namespace server {

using core::equal_ignoring_case;
/// Returns the text without leading and trailing spaces and tabs.
std::string_view trim(std::string_view text);
/// True for a method or field name: letters, digits and !#$%&'*+-.^_`|~, at least one.
bool is_token(std::string_view text);
/// Parses decimal digits without sign; empty for anything else or on overflow.
std::optional<std::uint64_t> parse_decimal(std::string_view text);
/// Splits at commas outside quoted strings; trims; omits empty elements.
std::vector<std::string_view> split_list(std::string_view text);

/// Returns empty on a broken escape or an encoded NUL. PlusSign: kIsSpace as in query strings.
enum class PlusSign : std::uint8_t { kIsPlus, kIsSpace };
std::optional<std::string> percent_decode(std::string_view text, PlusSign plus);
/// Parses `a=1&b=2`; a name without `=` has an empty value. Returns empty on a broken escape. A
/// percent sign after a digit at the end of a value stands for itself: `error=3%`.
std::optional<std::vector<std::pair<std::string, std::string>>> parse_query(std::string_view text);

/// Returns "/a/b" for "/a/b" and "/a/b/", and "" for "/": what precedes the paths of a server that
/// a proxy places below a path. Returns empty for anything else than a path of unreserved
/// characters, and for the segments `.` and `..`.
std::optional<std::string> base_path(std::string_view text);

/// Returns the media type in lower case without parameters: "text/html" for "Text/HTML;
/// charset=utf-8".
std::string media_type(std::string_view content_type);

}  // namespace server
