/// Views: what an answer says about a value S. A row names a member, holds its shape
/// (api/shapes.h) and prints it, so that answers and the schemas of /openapi.json cannot differ.
/// Unless a row `applies` only at times, its member is always there.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "api/json.h"
#include "api/shapes.h"
#include "api/values.h"

namespace api {

template <typename S>
struct ViewRow {
  std::string_view name;
  Json shape;
  Json (*print)(const S&);
  bool (*applies)(const S&) = nullptr;  ///< null: always
};

template <typename S>
struct View {
  std::string_view component;  ///< name in components/schemas; "": described where it is used
  std::string_view doc;
  std::vector<ViewRow<S>> rows;

  Json print(const S& value) const {
    Json object = Json::object();
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
  /// The shape of a member that this view prints.
  Json shape() const { return component.empty() ? schema() : shape::reference(component); }
};

/// Each element as the view prints it.
template <typename S, typename List>
Json print_list(const View<S>& view, const List& list) {
  Json printed = Json::array();
  for (const auto& element : list) {
    printed.push_back(view.print(element));
  }
  return printed;
}

/// null where there is none.
template <typename T>
Json or_null(const T& optional) {
  return optional ? Json(*optional) : Json(nullptr);
}

}  // namespace api
