/// Json: ordered JSON values, strict parsing and exact numbers.
#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "api/problem.h"

namespace api {

/// Members keep their order, which is that of the documentation.
using Json = nlohmann::ordered_json;

/// Returns text without line breaks. NaN and infinity become null; bytes that are not UTF-8 become
/// U+FFFD.
std::string dump(const Json& value);

/// Parses a whole text strictly: RFC 8259, no repeated member, with limits on depth, text size, key
/// length and number range (api/json/limits.h). Problems: 400 for invalid JSON, with the byte
/// offset; 413 for a text longer than bytes_max; 422 with the pointer for repeated members, depth,
/// and numbers out of double's range.
Parsed<Json> parse_json(std::string_view text, std::size_t bytes_max);

/// Returns the double with the shortest decimal that identifies the float: 0.8F is printed as 0.8,
/// and reads back exactly.
double shortest_double(float value);
/// Returns the shortest text; whole numbers without a point. For messages.
std::string number_text(double value);

/// Returns pointer + "/" + key, escaped by RFC 6901.
std::string join_pointer(std::string_view pointer, std::string_view key);

}  // namespace api
