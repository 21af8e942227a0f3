/// Json: ordered JSON values, strict reading and honest numbers.
#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "api/problem.h"

namespace api {

/// Members keep the order in which the documentation shows them.
using Json = nlohmann::ordered_json;

/// Text without line breaks. NaN and infinity become null; bytes that are not UTF-8 become U+FFFD.
std::string dump(const Json& value);
/// The same for people: indented by two spaces.
std::string dump_pretty(const Json& value);

/// Reads a whole text, strictly: RFC 8259, no repeated member, depth, text size, key length and
/// number range limited (api/limits.h).
/// Problems: 400 for what is not JSON, with the byte offset; 413 for a text beyond bytes_max; 422
/// with the pointer for repeated members, depth, and numbers that no double can hold.
Parsed<Json> parse_json(std::string_view text, std::size_t bytes_max);

/// The float as the shortest decimal that names it: 0.8F is shown as 0.8, and reads back exactly.
double shortest_double(float value);
/// Shortest text; whole numbers without a point. For messages.
std::string number_text(double value);

/// pointer + "/" + key, escaped by RFC 6901.
std::string join_pointer(std::string_view pointer, std::string_view key);

}  // namespace api
