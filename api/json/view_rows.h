/// Views: the representation of a value S in responses. A row names a member, holds its shape
/// (api/json/shapes.h) and prints it, so that responses and the schemas of /openapi.json cannot
/// differ. A member is always present unless its row has `applies`.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "api/json/json.h"
#include "api/json/shapes.h"
#include "api/json/values.h"

namespace api {

template <typename S>
struct ViewRow {
  std::string_view name;
  Json shape;
  Json (*print)(const S&);
  bool (*applies)(const S&) = nullptr;  ///< null: always
};

/// Functions that print a member: as it is, and by number_json().
template <auto pointer>
struct Member;
template <typename S, typename T, T S::*pointer>
struct Member<pointer> {
  static Json json(const S& value) { return value.*pointer; }
  static Json number(const S& value) { return number_json(value.*pointer); }
};
template <typename S>
struct View {
  std::string_view component;  ///< name in components/schemas; "": inlined where it is used
  std::string_view doc;
  std::vector<ViewRow<S>> rows;

  Json print(const S& value) const {
    Json object = Json::object();
    // An object that grows copies its members, with all objects in them, instead of moving them.
    object.get_ref<Json::object_t&>().reserve(rows.size());
    for (const ViewRow<S>& row : rows) {
      if (row.applies == nullptr || row.applies(value)) {
        object[std::string(row.name)] = row.print(value);
      }
    }
    return object;
  }
  Json schema() const {
    Json made = basic_schema("object", doc);
    made["properties"] = Json::object();
    made["required"] = Json::array();
    for (const ViewRow<S>& row : rows) {
      made["properties"][std::string(row.name)] = row.shape;
      if (row.applies == nullptr) {
        made["required"].push_back(row.name);
      }
    }
    made["additionalProperties"] = false;
    return made;
  }
  void add_to(Json& components) const { components[std::string(component)] = schema(); }
  /// Returns the shape of a member that this view prints.
  Json shape() const { return component.empty() ? schema() : shape::reference(component); }
};

/// Prints each element by the view.
template <typename S, typename List>
Json print_list(const View<S>& view, const List& list) {
  Json printed = Json::array();
  for (const auto& element : list) {
    printed.push_back(view.print(element));
  }
  return printed;
}

/// Prints null for an empty value.
template <typename T>
Json or_null(const T& optional) {
  return optional ? Json(*optional) : Json(nullptr);
}

}  // namespace api
