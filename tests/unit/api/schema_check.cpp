#include "tests/unit/api/schema_check.h"

#include <algorithm>
#include <cmath>
#include <regex>
#include <set>

#include <nlohmann/json.hpp>

#include "core/base/check.h"

namespace test_api {
namespace {

using api::Json;

bool has_type(const Json& value, const std::string& type) {
  if (type == "integer") {
    return value.is_number_integer() ||
           (value.is_number_float() && std::trunc(value.get<double>()) == value.get<double>());
  }
  return (type == "null" && value.is_null()) || (type == "boolean" && value.is_boolean()) ||
         (type == "number" && value.is_number()) || (type == "string" && value.is_string()) ||
         (type == "array" && value.is_array()) || (type == "object" && value.is_object());
}

void check_keywords(const Json& schema) {
  static const std::set<std::string> kKnown = {"$ref",
                                               "type",
                                               "description",
                                               "default",
                                               "enum",
                                               "const",
                                               "minimum",
                                               "maximum",
                                               "exclusiveMinimum",
                                               "exclusiveMaximum",
                                               "multipleOf",
                                               "minLength",
                                               "maxLength",
                                               "pattern",
                                               "format",
                                               "items",
                                               "minItems",
                                               "maxItems",
                                               "uniqueItems",
                                               "properties",
                                               "required",
                                               "additionalProperties",
                                               "propertyNames",
                                               "maxProperties",
                                               "minProperties",
                                               "anyOf",
                                               "examples",
                                               "x-default"};
  for (const auto& keyword : schema.items()) {
    CHECK(kKnown.count(keyword.key()) == 1);
  }
}

std::string number_fault(const Json& value, const Json& schema) {
  const double number = value.get<double>();
  const auto limit = [&schema](const char* key) { return schema.at(key).get<double>(); };
  const bool bad = (schema.contains("minimum") && number < limit("minimum")) ||
                   (schema.contains("maximum") && number > limit("maximum")) ||
                   (schema.contains("exclusiveMinimum") && number <= limit("exclusiveMinimum")) ||
                   (schema.contains("exclusiveMaximum") && number >= limit("exclusiveMaximum")) ||
                   (schema.contains("multipleOf") && std::fmod(number, limit("multipleOf")) != 0);
  return bad ? "number out of range" : "";
}

std::string text_fault(const Json& value, const Json& schema) {
  const auto& text = value.get_ref<const std::string&>();
  if ((schema.contains("minLength") && text.size() < schema.at("minLength").get<std::size_t>()) ||
      (schema.contains("maxLength") && text.size() > schema.at("maxLength").get<std::size_t>())) {
    return "length";
  }
  if (schema.contains("pattern") &&
      !std::regex_search(text, std::regex(schema.at("pattern").get<std::string>()))) {
    return "pattern";
  }
  return "";
}

std::string array_fault(const Json& value, const Json& schema, const Json& root,
                        const std::string& pointer) {
  if ((schema.contains("minItems") && value.size() < schema.at("minItems").get<std::size_t>()) ||
      (schema.contains("maxItems") && value.size() > schema.at("maxItems").get<std::size_t>())) {
    return pointer + ": number of items";
  }
  for (std::size_t i = 0; schema.contains("items") && i < value.size(); ++i) {
    const std::string fault =
        schema_fault(value[i], schema.at("items"), root, pointer + "/" + std::to_string(i));
    if (!fault.empty()) {
      return fault;
    }
  }
  return "";
}

std::string object_fault(const Json& value, const Json& schema, const Json& root,
                         const std::string& pointer) {
  if (schema.contains("minProperties") &&
      value.size() < schema.at("minProperties").get<std::size_t>()) {
    return pointer + ": number of members";
  }
  for (const Json& name : schema.value("required", Json::array())) {
    if (!value.contains(name.get<std::string>())) {
      return pointer + ": lacks " + name.get<std::string>();
    }
  }
  const Json properties = schema.value("properties", Json::object());
  const Json more = schema.value("additionalProperties", Json(true));
  for (const auto& member : value.items()) {
    const std::string place = api::join_pointer(pointer, member.key());
    std::string fault;
    if (properties.contains(member.key())) {
      fault = schema_fault(member.value(), properties.at(member.key()), root, place);
    } else if (more.is_object()) {
      fault = schema_fault(member.value(), more, root, place);
    } else if (more == Json(false)) {
      fault = place + ": not in the schema";
    }
    if (!fault.empty()) {
      return fault;
    }
  }
  return "";
}

}  // namespace

std::string schema_fault(const Json& value, const Json& schema, const Json& root,
                         const std::string& pointer) {
  check_keywords(schema);
  if (schema.contains("$ref")) {
    const Json::json_pointer target(schema.at("$ref").get<std::string>().substr(1));
    return schema_fault(value, root.at(target), root, pointer);
  }
  if (schema.contains("anyOf")) {
    bool any = false;
    for (const Json& each : schema.at("anyOf")) {
      any = any || schema_fault(value, each, root, pointer).empty();
    }
    if (!any) {
      return pointer + ": none of anyOf";
    }
  }
  if (schema.contains("const") && value != schema.at("const")) {
    return pointer + ": is not the constant";
  }
  if (schema.contains("enum")) {
    const Json& names = schema.at("enum");
    if (std::find(names.begin(), names.end(), value) == names.end()) {
      return pointer + ": not in enum";
    }
  }
  if (schema.contains("type")) {
    const Json types =
        schema.at("type").is_array() ? schema.at("type") : Json::array({schema.at("type")});
    bool any = false;
    for (const Json& type : types) {
      any = any || has_type(value, type.get<std::string>());
    }
    if (!any) {
      return pointer + ": type";
    }
  }
  std::string fault;
  if (value.is_number()) {
    fault = number_fault(value, schema);
  } else if (value.is_string()) {
    fault = text_fault(value, schema);
  } else if (value.is_array()) {
    return array_fault(value, schema, root, pointer);
  } else if (value.is_object()) {
    return object_fault(value, schema, root, pointer);
  }
  return fault.empty() ? "" : pointer + ": " + fault;
}

}  // namespace test_api
