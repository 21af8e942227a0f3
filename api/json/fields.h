/// Field tables: a std::tuple of rows (api/json/field_rows.h) over a plain struct S reads, checks,
/// prints and documents a whole JSON object. Factory functions for rows are at the end.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "api/json/faults.h"
#include "api/json/field_rows.h"
#include "api/json/json.h"
#include "api/json/limits.h"
#include "api/json/values.h"
#include "core/settings/choices.h"

namespace api {

/// Prints the inner row only while `applies(s)`.
template <typename Row, typename Applies>
struct ShownIfRow {
  Row row;
  Applies applies;

  constexpr std::string_view name() const { return row.name(); }
  constexpr bool required() const { return row.required(); }
  template <typename S>
  void read(const Json& value, S& out, const std::string& pointer, Faults& faults) const {
    row.read(value, out, pointer, faults);
  }
  template <typename S>
  void print(const S& s, Json& object) const {
    if (applies(s)) {
      row.print(s, object);
    }
  }
  template <typename S>
  void schema(const S& defaults, Json& properties) const {
    row.schema(defaults, properties);
    properties[std::string(row.name())][kMayBeAbsent] = true;
  }
};

/// Uses the inner row while `applies(s)`, which examines members read earlier. Otherwise the member
/// is refused (except null, so that merge patches can remove it) and not printed.
template <typename Row, typename Applies, typename Otherwise>
struct WhenRow : ShownIfRow<Row, Applies> {
  Otherwise otherwise;  ///< returns why: "applies only to type 'power'"

  static constexpr bool required() { return false; }
  template <typename S>
  void read(const Json& value, S& out, const std::string& pointer, Faults& faults) const {
    if (value.is_null()) {
      return;
    }
    if (!this->applies(std::as_const(out))) {
      faults.add(pointer, otherwise());
      return;
    }
    this->row.read(value, out, pointer, faults);
  }
};

/// For WhenRow: while the registry row of the value chosen by `type` accepts the option.
template <typename Type, typename Entries>
struct AcceptedBy {
  std::string_view pointer;
  Type type;        ///< accessor of the chosen value
  Entries entries;  ///< its registry

  template <typename S>
  bool operator()(const S& s) const {
    return core::row_of(entries(), type(s)).accepts.has(pointer);
  }
  std::string operator()() const {
    std::string names;
    for (const auto& entry : entries()) {
      if (entry.accepts.has(pointer)) {
        names += (names.empty() ? "type '" : ", '") + std::string(entry.name) + "'";
      }
    }
    return "applies only to " + names;
  }
};

/// An object that may be null, which `has(s)` records; the inner row then keeps its values.
template <typename Row, typename Has>
struct NullableRow {
  Row row;
  Has has;  ///< accessor of a bool

  constexpr std::string_view name() const { return row.name(); }
  constexpr bool required() const { return row.required(); }
  template <typename S>
  void read(const Json& value, S& out, const std::string& pointer, Faults& faults) const {
    has(out) = !value.is_null();
    if (has(out)) {
      row.read(value, out, pointer, faults);
    }
  }
  template <typename S>
  void print(const S& s, Json& object) const {
    if (has(s)) {
      row.print(s, object);
    } else {
      object[std::string(row.name())] = nullptr;
    }
  }
  template <typename S>
  void schema(const S& defaults, Json& properties) const {
    row.schema(defaults, properties);
    properties[std::string(row.name())]["type"] = {"object", "null"};
  }
};

template <typename Table>
std::vector<std::string_view> member_names(const Table& table) {
  std::vector<std::string_view> names;
  std::apply([&](const auto&... row) { (names.push_back(row.name()), ...); }, table);
  return names;
}

/// Reads the members of `value`, in the order of the table.
template <typename Table, typename S>
void read_members(const Table& table, const Json& value, S& out, const std::string& pointer,
                  Faults& faults) {
  if (!expect_object(value, pointer, faults)) {
    return;
  }
  refuse_unknown_members(value, member_names(table), pointer, faults);
  const auto read_row = [&](const auto& row) {
    const auto member = value.find(std::string(row.name()));
    if (member != value.end()) {
      row.read(*member, out, join_pointer(pointer, row.name()), faults);
    } else if (row.required()) {
      faults.add(join_pointer(pointer, row.name()), "is required");
    }
  };
  std::apply([&](const auto&... row) { (read_row(row), ...); }, table);
}

/// Reads the members of a JSON body. body: the defaults.
template <typename Body, typename Table>
Parsed<Body> parse_body(const Table& table, std::string_view text, Body body = {}) {
  const Parsed<Json> value = parse_json(text, limits::kBodyBytes);
  if (!value) {
    return value.problem();
  }
  Faults faults;
  read_members(table, *value, body, "", faults);
  if (!faults.empty()) {
    return faults.problem();
  }
  return body;
}

template <typename Table, typename S>
Json print_members(const Table& table, const S& s) {
  Json object = Json::object();
  object.get_ref<Json::object_t&>().reserve(std::tuple_size_v<Table>);  // as in View::print()
  std::apply([&](const auto&... row) { (row.print(s, object), ...); }, table);
  return object;
}

template <typename Table, typename S>
Json object_schema(const Table& table, const S& defaults, std::string_view doc) {
  Json schema = basic_schema("object", doc);
  Json properties = Json::object();
  Json required = Json::array();
  const auto add_row = [&](const auto& row) {
    row.schema(defaults, properties);
    if (row.required()) {
      required.push_back(row.name());
    }
  };
  std::apply([&](const auto&... row) { (add_row(row), ...); }, table);
  schema["properties"] = std::move(properties);
  if (!required.empty()) {
    schema["required"] = std::move(required);
  }
  schema["additionalProperties"] = false;
  return schema;
}

/// A nested object over the part of S returned by the accessor.
template <typename Get, typename Table>
struct ObjectRow : RowBase<Get> {
  Table table;

  template <typename S>
  void read(const Json& value, S& out, const std::string& pointer, Faults& faults) const {
    read_members(table, value, this->get(out), pointer, faults);
  }
  template <typename S>
  void print(const S& s, Json& object) const {
    object[std::string(this->key)] = print_members(table, this->get(s));
  }
  template <typename S>
  void schema(const S& defaults, Json& properties) const {
    properties[std::string(this->key)] = object_schema(table, this->get(defaults), this->doc);
  }
};

// Factory functions, since clang 14 does not deduce template arguments of aggregates.

template <typename Get>
constexpr auto number(std::string_view key, Get get, Range range, std::string_view doc) {
  return NumberRow<Get>{{key, get, doc}, range};
}
template <typename Get>
constexpr auto text(std::string_view key, Get get, TextRule rule, std::string_view doc) {
  return TextRow<Get>{{key, get, doc}, rule, false};
}
template <typename Get>
constexpr auto required_text(std::string_view key, Get get, TextRule rule, std::string_view doc) {
  return TextRow<Get>{{key, get, doc}, rule, true};
}
template <typename Get>
constexpr auto flag(std::string_view key, Get get, std::string_view doc) {
  return FlagRow<Get>{{key, get, doc}};
}
template <typename Get>
constexpr auto triple(std::string_view key, Get get, Range range, std::string_view doc) {
  return TripleRow<Get>{{key, get, doc}, range};
}
template <typename Get, typename Entries>
constexpr auto choice(std::string_view key, Get get, Entries entries, std::string_view doc) {
  return ChoiceRow<Get, Entries>{{key, get, doc}, entries};
}
template <typename Get, typename... Rows>
constexpr auto nested(std::string_view key, Get get, std::string_view doc, Rows... rows) {
  return ObjectRow<Get, std::tuple<Rows...>>{{key, get, doc}, std::tuple<Rows...>(rows...)};
}
/// A nested object whose rows access the whole struct.
template <typename... Rows>
constexpr auto group(std::string_view key, std::string_view doc, Rows... rows) {
  return nested(
      key, [](auto& s) -> auto& { return s; }, doc, rows...);
}
template <typename Applies, typename Row>
constexpr auto when(Applies applies, std::string_view otherwise, Row row) {
  const auto why = [otherwise] { return std::string(otherwise); };
  return WhenRow<Row, Applies, decltype(why)>{{row, applies}, why};
}
template <typename Type, typename Entries, typename Row>
constexpr auto option_of(std::string_view pointer, Type type, Entries entries, Row row) {
  using By = AcceptedBy<Type, Entries>;
  return WhenRow<Row, By, By>{{row, {pointer, type, entries}}, {pointer, type, entries}};
}
template <typename Has, typename Row>
constexpr auto nullable(Has has, Row row) {
  return NullableRow<Row, Has>{row, has};
}
template <typename Applies, typename Row>
constexpr auto shown_if(Applies applies, Row row) {
  return ShownIfRow<Row, Applies>{row, applies};
}

}  // namespace api
