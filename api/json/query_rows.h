/// Query tables: a std::tuple of rows over a plain struct S reads, checks and documents a query
/// string. The rows number(), text(), choice() and flag() of api/json/fields.h work as in bodies;
/// parameter() makes a row with its own functions. A default of null or "" means that the parameter
/// is absent, and is not documented.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include <nlohmann/json.hpp>

#include "api/json/faults.h"
#include "api/json/fields.h"
#include "api/json/json.h"
#include "api/requests.h"

namespace api {

/// A parameter with its own functions.
template <typename S>
struct ParameterField {
  std::string_view key;
  std::string_view doc;
  void (*read_text)(const std::string& text, S& out, const std::string& pointer, Faults& faults);
  Json (*make_schema)(const S& defaults);
  bool is_repeatable = false;
  bool must_be_there = false;

  constexpr std::string_view name() const { return key; }
  constexpr bool required() const { return must_be_there; }
};

/// Returns the text as a number if all of it is one in JSON's grammar (not "0x10", "inf" or " 5"),
/// otherwise as a string.
inline Json number_in_query(const std::string& text) {
  Json value = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  const bool is_plain =
      !text.empty() && text.find_first_not_of("0123456789+-.eE") == std::string::npos;
  return is_plain && value.is_number() ? value : Json(text);
}

/// Converts the text of a parameter to the JSON value that its row reads.
template <typename Row>
Json value_in_query(const Row& /*row*/, const std::string& text) {
  return text;
}
template <typename Get>
Json value_in_query(const NumberRow<Get>& /*row*/, const std::string& text) {
  return number_in_query(text);
}
/// Accepts 1 and 0 for true and false.
template <typename Get>
Json value_in_query(const FlagRow<Get>& /*row*/, const std::string& text) {
  const bool is_true = text == "1" || text == "true";
  const bool is_false = text == "0" || text == "false";
  return is_true || is_false ? Json(is_true) : Json(text);
}

template <typename Row, typename S>
void read_parameter(const Row& row, const std::string& text, S& out, const std::string& pointer,
                    Faults& faults) {
  if constexpr (requires { row.read_text; }) {
    row.read_text(text, out, pointer, faults);
  } else {
    row.read(value_in_query(row, text), out, pointer, faults);
  }
}

template <typename Row>
constexpr bool is_repeatable(const Row& row) {
  if constexpr (requires { row.is_repeatable; }) {
    return row.is_repeatable;
  } else {
    return false;
  }
}

/// Reads the parameters in their order. Refuses unknown ones, repeated ones unless their row allows
/// it, and missing required ones.
template <typename Table, typename S>
void read_query(const Table& table, QueryParams query, S& out, Faults& faults) {
  std::vector<std::string> seen;
  for (const auto& [name, text] : query) {
    const std::string pointer = join_pointer("", name);
    const bool is_repeated = std::find(seen.begin(), seen.end(), name) != seen.end();
    seen.push_back(name);
    bool is_known = false;
    const auto try_row = [&, &name = name, &text = text](const auto& row) {
      if (row.name() != name) {
        return;
      }
      is_known = true;
      if (is_repeated && !is_repeatable(row)) {
        faults.add(pointer, "appears more than once");
      } else {
        read_parameter(row, text, out, pointer, faults);
      }
    };
    std::apply([&](const auto&... row) { (try_row(row), ...); }, table);
    if (!is_known) {
      faults.add(pointer, "unknown query parameter");
    }
  }
  const auto require_row = [&](const auto& row) {
    if (row.required() && std::find(seen.begin(), seen.end(), row.name()) == seen.end()) {
      faults.add(join_pointer("", row.name()), "is required");
    }
  };
  std::apply([&](const auto&... row) { (require_row(row), ...); }, table);
}

/// Returns an OpenAPI parameter object.
template <typename Row, typename S>
Json parameter_json(const Row& row, const S& defaults) {
  Json schema;
  std::string doc;
  if constexpr (requires { row.make_schema; }) {
    schema = row.make_schema(defaults);
    doc = row.doc;
  } else {
    Json properties;
    row.schema(defaults, properties);
    schema = std::move(properties.front());
    doc = schema.value("description", "");
    schema.erase("description");
  }
  if (const auto found = schema.find("default");
      found != schema.end() && (found->is_null() || *found == Json(""))) {
    schema.erase("default");
  }
  // Generated code cannot assign a default to a parameter of several types.
  if (schema.contains("anyOf") && schema.contains("default")) {
    schema["x-default"] = schema["default"];
    schema.erase("default");
  }
  // Keeps the first of [type, "null"]: a query string has no null.
  if (schema.contains("type") && schema["type"].is_array()) {
    schema["type"] = Json(schema["type"].front());
  }
  return {{"name", row.name()},
          {"in", "query"},
          {"required", row.required()},
          {"description", doc},
          {"schema", std::move(schema)}};
}

/// Returns the table as a list of OpenAPI parameter objects.
template <typename Table, typename S>
Json query_parameters(const Table& table, const S& defaults) {
  Json list = Json::array();
  std::apply([&](const auto&... row) { (list.push_back(parameter_json(row, defaults)), ...); },
             table);
  return list;
}

/// Parses a whole query. out: the defaults.
template <typename Table, typename S>
Parsed<S> parse_query(const Table& table, QueryParams query, S out) {
  Faults faults;
  read_query(table, query, out, faults);
  if (!faults.empty()) {
    return faults.problem();
  }
  return out;
}

// Rows and values shared by several queries.

inline constexpr double kRevisionMax = std::numeric_limits<std::uint32_t>::max();
inline Json text_schema() { return {{"type", "string"}}; }

/// Calls `take` with each part of a comma-separated list.
template <typename Take>
void each_part(const std::string& text, const Take& take) {
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    take(text.substr(begin, end - begin));
    begin = end + 1;
  }
}

/// Ignored here: the server reads the ticket when it authorizes the request.
template <typename S>
constexpr auto ticket_row() {
  return ParameterField<S>{"ticket", "A ticket of POST /v1/stream-tickets, instead of the key.",
                           [](const std::string&, S&, const std::string&, Faults&) {},
                           [](const S&) { return text_schema(); }};
}

}  // namespace api
