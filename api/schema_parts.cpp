#include "api/schema_parts.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

#include "api/json/shapes.h"
#include "core/base/check.h"

namespace api {
namespace {

bool has_type(const Json& schema, std::string_view type) {
  const auto found = schema.find("type");
  return found != schema.end() &&
         (*found == type ||
          (found->is_array() && std::find(found->begin(), found->end(), type) != found->end()));
}

/// "samples_per_pixel" is "SamplesPerPixel".
std::string camel_case(std::string_view member) {
  std::string made;
  bool starts = true;
  for (const char c : member) {
    if (c != '_') {
      made += starts && c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    }
    starts = c == '_';
  }
  return made;
}

/// Adds the parts of one component after another to `named`, each before what uses it.
class ComponentNames {
 public:
  explicit ComponentNames(Json& named) : named_(named) {}

  /// Replaces the objects inside the schema by references. name: of the schema.
  void take_inner(Json& schema, const std::string& name) {
    if (const auto found = schema.find("properties"); found != schema.end()) {
      for (const auto& property : found->items()) {
        take(property.value(), name + camel_case(property.key()));
      }
    }
    for (const char* inner : {"items", "additionalProperties"}) {
      if (const auto found = schema.find(inner); found != schema.end() && found->is_object()) {
        take(*found, name);
      }
    }
  }

 private:
  void take(Json& schema, const std::string& name) {
    take_inner(schema, name);
    if (!schema.contains("properties")) {
      return;
    }
    Json part = schema;
    Json member = Json::object();  // What stays at the place of use.
    for (const char* own : {"description", "x-default"}) {
      if (part.contains(own)) {
        member[own] = part[own];
      }
    }
    part.erase("x-default");
    part["type"] = "object";
    const Json reference = shape::reference(name_of(std::move(part), name));
    member.update(has_type(schema, "null") ? shape::nullable(reference) : reference);
    schema = std::move(member);
  }

  std::string name_of(Json part, const std::string& name) {
    const auto without_description = [](Json schema) {
      schema.erase("description");
      return schema;
    };
    const Json wanted = without_description(part);
    for (const auto& known : named_.items()) {
      if (without_description(known.value()) == wanted) {
        return known.key();
      }
    }
    CHECK(!named_.contains(name));
    named_[name] = std::move(part);
    return name;
  }

  Json& named_;
};

}  // namespace

void name_parts(Json& schemas) {
  Json named = Json::object();
  ComponentNames names(named);
  for (const auto& schema : schemas.items()) {
    names.take_inner(schema.value(), schema.key());
    CHECK(!named.contains(schema.key()));
    named[schema.key()] = std::move(schema.value());
  }
  schemas = std::move(named);
}

void add_number_formats(Json& document) {
  if (document.is_object() && !document.contains("format")) {
    if (has_type(document, "integer")) {
      constexpr auto kMost = std::numeric_limits<std::int32_t>::max();
      const bool is_small = document.contains("minimum") && document.contains("maximum") &&
                            document["minimum"].get<double>() >= -kMost &&
                            document["maximum"].get<double>() <= kMost;
      document["format"] = is_small ? "int32" : "int64";
    } else if (has_type(document, "number")) {
      document["format"] = "double";
    }
  }
  if (document.is_structured()) {
    for (Json& inner : document) {
      add_number_formats(inner);
    }
  }
}

}  // namespace api
