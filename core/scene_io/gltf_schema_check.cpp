#include "core/scene_io/gltf_schema_check.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

#include "core/scene_io/gltf_schema.h"

namespace core {
namespace {

using Json = GltfJson;

// JSON readers represent integers up to 2^53 exactly; file offsets are far smaller.
constexpr double kIntegerMax = 9007199254740992.0;
constexpr double kNumberMax = 3.4e38;  // FLT_MAX, rounded down

Error invalid(std::string where, std::string message) {
  return {ErrorCode::kInvalidArgument, std::move(message), std::move(where)};
}

std::string number_text(double v) {
  const bool whole = v == std::floor(v) && std::abs(v) < kIntegerMax;
  return whole ? Json(static_cast<std::int64_t>(v)).dump() : Json(v).dump();
}

std::string list_of(std::string_view one_of) {
  std::string text(one_of);
  for (std::size_t at = text.find('|'); at != std::string::npos; at = text.find('|')) {
    text.replace(at, 1, ", ");
  }
  return text;
}

bool is_one_of(std::string_view value, std::string_view one_of) {
  for (std::size_t at = 0; at <= one_of.size();) {
    const std::size_t end = std::min(one_of.find('|', at), one_of.size());
    if (one_of.substr(at, end - at) == value) {
      return true;
    }
    at = end + 1;
  }
  return false;
}

// JSON pointers escape ~ and / (RFC 6901).
std::string pointer_step(std::string_view name) {
  std::string step = "/";
  for (const char c : name) {
    step += c == '~' ? "~0" : (c == '/' ? "~1" : std::string(1, c));
  }
  return step;
}

/// Traverses the document along the schemas. Converts integers written as 5.0 to 5.
class SchemaWalk {
 public:
  explicit SchemaWalk(Json& root) : root_(root) {
    for (const char* name :
         {"accessors", "animations", "buffers", "bufferViews", "cameras", "images", "materials",
          "meshes", "nodes", "samplers", "scenes", "skins", "textures"}) {
      sizes_[name] = array_size(Json::json_pointer(std::string("/") + name));
    }
    sizes_["image-based lights"] =
        array_size(Json::json_pointer("/extensions/EXT_lights_image_based/lights"));
    sizes_["light profiles"] = array_size(Json::json_pointer("/extensions/EXT_lights_ies/lights"));
    sizes_["lights"] = array_size(Json::json_pointer("/extensions/KHR_lights_punctual/lights"));
    sizes_["variants"] =
        array_size(Json::json_pointer("/extensions/KHR_materials_variants/variants"));
  }

  Status check() { return check_object(root_, "root", ""); }

 private:
  std::size_t array_size(const Json::json_pointer& at) const {
    return root_.contains(at) && root_.at(at).is_array() ? root_.at(at).size() : 0;
  }

  Status check_object(Json& value, std::string_view schema, const std::string& where) {
    if (!value.is_object()) {
      return invalid(where, shown(value) + " is not an object");
    }
    if (const auto* members = find_schema(schema)) {
      for (const SchemaMember& member : *members) {
        const auto it = value.find(member.name);
        if (it == value.end()) {
          if (member.required) {
            return invalid(where,
                           "the required member \"" + std::string(member.name) + "\" is missing");
          }
          continue;
        }
        if (auto status = check_member(*it, member, where + pointer_step(member.name)); !status) {
          return status;
        }
      }
    }
    const auto extensions = value.find("extensions");
    if (extensions == value.end()) {
      return ok_status();
    }
    const std::string extensions_where = where + "/extensions";
    if (!extensions->is_object()) {
      return invalid(extensions_where, shown(*extensions) + " is not an object");
    }
    for (auto& [name, extension] : extensions->items()) {
      if (auto status = check_object(extension, std::string(schema) + "/" + name,
                                     extensions_where + pointer_step(name));
          !status) {
        return status;
      }
    }
    return ok_status();
  }

  Status check_member(Json& value, const SchemaMember& member, const std::string& where) {
    switch (member.kind) {
      case JsonKind::kInteger:
        return check_integer(value, member, where);
      case JsonKind::kNumber:
        return check_number(value, member, where);
      case JsonKind::kString:
        return check_string(value, member, where);
      case JsonKind::kBoolean:
        return value.is_boolean() ? ok_status()
                                  : Status(invalid(where, shown(value) + " is not true or false"));
      case JsonKind::kObject:
        return check_object(value, member.child, where);
      case JsonKind::kIntegerMap:
        return check_integer_map(value, member, where);
      case JsonKind::kIntegers:
      case JsonKind::kNumbers:
      case JsonKind::kStrings:
      case JsonKind::kObjects:
      case JsonKind::kIntegerMaps:
      case JsonKind::kIntegerRows:
      case JsonKind::kNumberRows:
        break;
    }
    if (!value.is_array()) {
      return invalid(where, shown(value) + " is not an array");
    }
    if (value.size() < member.count_min || value.size() > member.count_max) {
      return invalid(where, std::to_string(value.size()) + " elements; expected " +
                                std::to_string(member.count_min) +
                                (member.count_max == member.count_min ? "" : " or more"));
    }
    for (std::size_t i = 0; i < value.size(); ++i) {
      if (auto status = check_element(value[i], member, where + "/" + std::to_string(i)); !status) {
        return status;
      }
    }
    return ok_status();
  }

  Status check_element(Json& value, const SchemaMember& member, const std::string& where) {
    switch (member.kind) {
      case JsonKind::kIntegers:
        return check_integer(value, member, where);
      case JsonKind::kNumbers:
        return check_number(value, member, where);
      case JsonKind::kStrings:
        return check_string(value, member, where);
      case JsonKind::kIntegerMaps:
        return check_integer_map(value, member, where);
      case JsonKind::kIntegerRows:
      case JsonKind::kNumberRows:
        return check_row(value, member, where);
      default:
        return check_object(value, member.child, where);
    }
  }

  Status check_row(Json& value, const SchemaMember& member, const std::string& where) const {
    if (!value.is_array() || value.size() != member.row_count) {
      return invalid(where, shown(value) + " is not an array of " +
                                std::to_string(member.row_count) + " elements");
    }
    for (std::size_t i = 0; i < value.size(); ++i) {
      const std::string place = where + "/" + std::to_string(i);
      const bool integers = member.kind == JsonKind::kIntegerRows;
      if (auto status = integers ? check_integer(value[i], member, place)
                                 : check_number(value[i], member, place);
          !status) {
        return status;
      }
    }
    return ok_status();
  }

  Status check_integer(Json& value, const SchemaMember& member, const std::string& where) const {
    if (!value.is_number()) {
      return invalid(where, shown(value) + " is not an integer");
    }
    const double number = value.get<double>();
    if (number != std::floor(number) || std::abs(number) > kIntegerMax) {
      return invalid(where, shown(value) + " is not an integer below 2^53");
    }
    if (value.is_number_float()) {
      value = static_cast<std::int64_t>(number);
    }
    if (!member.refers_to.empty()) {
      const auto size = static_cast<double>(sizes_.at(std::string(member.refers_to)));
      if (number < 0 || number >= size) {
        return invalid(where, shown(value) + " names none of the " + number_text(size) + " " +
                                  std::string(member.refers_to));
      }
      return ok_status();
    }
    return in_range(value, member, where);
  }

  static Status check_number(const Json& value, const SchemaMember& member,
                             const std::string& where) {
    if (!value.is_number()) {
      return invalid(where, shown(value) + " is not a number");
    }
    if (!(std::abs(value.get<double>()) <= kNumberMax)) {
      return invalid(where, shown(value) + " is too large for a 32-bit float");
    }
    return in_range(value, member, where);
  }

  static Status in_range(const Json& value, const SchemaMember& member, const std::string& where) {
    const double number = value.get<double>();
    if (number < member.min || number > member.max) {
      const bool no_upper = std::isinf(member.max) || member.max >= kNumberMax;
      return invalid(where, shown(value) + (no_upper ? " is below " + number_text(member.min)
                                                     : " is outside [" + number_text(member.min) +
                                                           ", " + number_text(member.max) + "]"));
    }
    if (!member.one_of.empty() && !is_one_of(shown(value), member.one_of)) {
      return invalid(where, shown(value) + " is not one of " + list_of(member.one_of));
    }
    return ok_status();
  }

  static Status check_string(const Json& value, const SchemaMember& member,
                             const std::string& where) {
    if (!value.is_string()) {
      return invalid(where, shown(value) + " is not a string");
    }
    if (!member.one_of.empty() && !is_one_of(value.get_ref<const std::string&>(), member.one_of)) {
      return invalid(where, shown(value) + " is not one of " + list_of(member.one_of));
    }
    return ok_status();
  }

  Status check_integer_map(Json& value, const SchemaMember& member,
                           const std::string& where) const {
    if (!value.is_object()) {
      return invalid(where, shown(value) + " is not an object");
    }
    if (value.size() < member.count_min) {
      return invalid(where, "is empty; at least one member is required");
    }
    for (auto& [name, element] : value.items()) {
      if (auto status = check_integer(element, member, where + pointer_step(name)); !status) {
        return status;
      }
    }
    return ok_status();
  }

  Json& root_;
  std::map<std::string, std::size_t> sizes_;
};

}  // namespace

std::string shown(const GltfJson& value) {
  constexpr std::size_t kLongest = 60;
  std::string text = value.dump(-1, ' ', true, GltfJson::error_handler_t::replace);
  return text.size() > kLongest ? text.substr(0, kLongest) + "..." : text;
}

Status check_schemas(GltfJson& root) { return SchemaWalk(root).check(); }

}  // namespace core
