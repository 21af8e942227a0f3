#include "core/scene_io/gltf_schema_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

#include "core/base/invalid.h"
#include "core/math/numbers.h"
#include "core/scene_io/gltf_schema.h"

namespace core {
namespace {

using Json = GltfJson;

// JSON readers represent integers up to here exactly; file offsets are far smaller.
constexpr double kIntegerMax = kExactIntegers;
constexpr double kNumberMax = 3.4e38;  // FLT_MAX, rounded down

constexpr const char* kIgnored = "it is ignored";

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

/// An array whose elements other parts of the document refer to.
struct PartArray {
  std::string_view name;  ///< as in SchemaMember::refers_to
  std::string_view pointer;
  std::string_view schema;  ///< of an element
  bool is_deferred;         ///< a fault is an error only where the part is read
  std::string_view stub;    ///< stands for an element that was left out
};
constexpr std::array kParts = {
    PartArray{"accessors", "/accessors", "accessor", true, "{}"},
    PartArray{"animations", "/animations", "animation", true, R"({"channels":[],"samplers":[]})"},
    PartArray{"buffers", "/buffers", "buffer", false, "{}"},
    PartArray{"bufferViews", "/bufferViews", "bufferView", true, "{}"},
    PartArray{"cameras", "/cameras", "camera", true,
              R"({"type":"perspective","perspective":{"yfov":1,"znear":1}})"},
    PartArray{"images", "/images", "image", true, "{}"},
    PartArray{"materials", "/materials", "material", false, "{}"},
    PartArray{"meshes", "/meshes", "mesh", false, R"({"primitives":[]})"},
    PartArray{"nodes", "/nodes", "node", false, "{}"},
    PartArray{"samplers", "/samplers", "sampler", false, "{}"},
    PartArray{"scenes", "/scenes", "scene", false, "{}"},
    PartArray{"skins", "/skins", "skin", false, R"({"joints":[]})"},
    PartArray{"textures", "/textures", "texture", false, "{}"},
    PartArray{"lights", "/extensions/KHR_lights_punctual/lights", "light", false,
              R"({"type":"point"})"},
    PartArray{"light profiles", "/extensions/EXT_lights_ies/lights", "profile", false, "{}"},
    PartArray{"image-based lights", "/extensions/EXT_lights_image_based/lights", "imageLight",
              false, "{}"}};

bool is_part(const SchemaMember& member) {
  return member.kind == JsonKind::kObjects &&
         std::any_of(kParts.begin(), kParts.end(),
                     [&](const PartArray& part) { return part.schema == member.child; });
}

// Lengths of unit quaternions may differ from 1 by this much; source: Khronos' glTF-Validator,
// unitLengthThresholdVec4.
constexpr double kUnitQuaternion = 0.00769;

/// Traverses the document along the schemas, from the scenes and animations along references, and
/// last to what nothing refers to. Converts integers written as 5.0 to 5.
class SchemaWalk {
 public:
  SchemaWalk(Json& root, GltfTables& tables, GltfRepairs& repairs)
      : root_(root), tables_(tables), repairs_(repairs) {
    for (const PartArray& part : kParts) {
      sizes_[std::string(part.name)] = array_size(pointer_of(part));
    }
    sizes_["variants"] =
        array_size(Json::json_pointer("/extensions/KHR_materials_variants/variants"));
  }

  Status check() {
    if (auto status = check_object(root_, "root", ""); !status || repairs_.is_strict()) {
      use_all();
      return status;
    }
    enqueue_all(sizes_.at("scenes") > 0 ? "scenes" : "nodes");
    if (auto status = follow(); !status) {
      return status;
    }
    enqueue_all("animations");
    if (auto status = follow(); !status) {
      return status;
    }
    const std::set<GltfPart> used = tables_.used;
    is_unused_ = true;
    for (const PartArray& part : kParts) {
      enqueue_all(part.name);
    }
    const auto status = follow();
    tables_.used = used;
    return status;
  }

 private:
  static Json::json_pointer pointer_of(const PartArray& part) {
    return Json::json_pointer(std::string(part.pointer));
  }
  std::size_t array_size(const Json::json_pointer& at) const {
    return root_.contains(at) && root_.at(at).is_array() ? root_.at(at).size() : 0;
  }

  void use_all() {
    for (const PartArray& part : kParts) {
      enqueue_all(part.name);
    }
    open_.clear();
  }
  void enqueue_all(std::string_view name) {
    for (std::size_t i = 0; i < sizes_.at(std::string(name)); ++i) {
      enqueue({std::string(name), i});
    }
  }
  void enqueue(const GltfPart& part) {
    if (tables_.used.insert(part).second) {
      open_.push_back(part);
    }
  }

  /// Checks the parts that are enqueued, and those that they refer to.
  Status follow() {
    while (!open_.empty()) {
      const GltfPart at = open_.front();
      open_.pop_front();
      const auto* const part = std::find_if(kParts.begin(), kParts.end(),
                                            [&](const PartArray& p) { return p.name == at.array; });
      Json& element = root_.at(pointer_of(*part)).at(at.index);
      const std::string where = std::string(part->pointer) + "/" + std::to_string(at.index);
      const Status status = check_object(element, part->schema, where);
      if (status) {
        continue;
      }
      if (!part->is_deferred && !is_unused_) {
        return status;
      }
      leave_out(tables_, at, status.error(), repairs_);
      element = Json::parse(part->stub);
    }
    return ok_status();
  }

  Status check_object(Json& value, std::string_view schema, const std::string& where) {
    if (!value.is_object()) {
      return invalid(where, shown(value) + " is not an object");
    }
    if (const auto* members = find_schema(schema)) {
      for (const SchemaMember& member : *members) {
        if (auto status = check_member_of(value, member, where); !status) {
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
      const std::string fault = shown(*extensions) + " is not an object";
      value.erase(extensions);
      return repairs_.mended("left_out", extensions_where, fault, kIgnored);
    }
    for (auto& [name, extension] : extensions->items()) {
      const std::string extended = std::string(schema) + "/" + name;
      if (find_schema(extended) == nullptr && !repairs_.is_strict()) {
        continue;
      }
      if (auto status = check_object(extension, extended, extensions_where + pointer_step(name));
          !status) {
        return status;
      }
    }
    return ok_status();
  }

  Status check_member_of(Json& object, const SchemaMember& member, const std::string& where) {
    const auto it = object.find(member.name);
    const std::string place = where + pointer_step(member.name);
    if (it == object.end()) {
      if (!member.required) {
        return ok_status();
      }
      std::string fault = "the required member \"" + std::string(member.name) + "\" is missing";
      if (std::isnan(member.otherwise)) {
        return invalid(where, std::move(fault));
      }
      object[std::string(member.name)] = member.otherwise;
      return repairs_.mended("missing", where, std::move(fault),
                             number_text(member.otherwise) + " counts");
    }
    Status status = check_member(*it, member, place);
    const bool may_go = member.repair == Repair::kLeaveOut || member.repair == Repair::kClamp;
    if (status || member.required || !may_go) {
      return status;
    }
    object.erase(it);
    return repairs_.mended("left_out", status.error().where, status.error().message, kIgnored);
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
    if (is_part(member) && !repairs_.is_strict()) {
      return ok_status();  // follow() checks the elements
    }
    for (std::size_t i = 0; i < value.size(); ++i) {
      if (auto status = check_element(value[i], member, where + "/" + std::to_string(i)); !status) {
        return status;
      }
    }
    return member.repair == Repair::kNormalize ? normalize_quaternion(value, where) : ok_status();
  }

  /// Strict reading accepts any length but 0 whose elements are in their range.
  Status normalize_quaternion(Json& value, const std::string& where) const {
    double squares = 0;
    for (const Json& element : value) {
      squares += element.get<double>() * element.get<double>();
    }
    const double size = std::sqrt(squares);
    if ((repairs_.is_strict() && size > 0) || std::abs(size - 1) <= kUnitQuaternion) {
      return ok_status();
    }
    const std::string fault = shown(value) + " is not a unit quaternion";
    if (!(size > 0)) {
      value = {0, 0, 0, 1};
      return repairs_.mended("normalized", where, fault, "it does not turn");
    }
    for (Json& element : value) {
      element = element.get<double>() / size;
    }
    return repairs_.mended("normalized", where, fault, "it is normalised");
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

  Status check_row(Json& value, const SchemaMember& member, const std::string& where) {
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

  Status check_integer(Json& value, const SchemaMember& member, const std::string& where) {
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
      refer(member.refers_to, static_cast<std::size_t>(number));
      return ok_status();
    }
    return in_range(value, member, where);
  }

  void refer(std::string_view array, std::size_t index) {
    if (array != "variants") {
      enqueue({std::string(array), index});
    }
  }

  Status check_number(Json& value, const SchemaMember& member, const std::string& where) const {
    if (!value.is_number()) {
      return invalid(where, shown(value) + " is not a number");
    }
    const double number = value.get<double>();
    const double bound = number < 0 ? -member.min : member.max;
    if (!(std::abs(number) <= kNumberMax) && !(bound < kNumberMax)) {
      return invalid(where, shown(value) + " is too large for a 32-bit float");
    }
    return in_range(value, member, where);
  }

  Status in_range(Json& value, const SchemaMember& member, const std::string& where) const {
    const double number = value.get<double>();
    if (number < member.min || number > member.max) {
      const bool no_upper = std::isinf(member.max) || member.max >= kNumberMax;
      std::string fault = shown(value) + (no_upper ? " is below " + number_text(member.min)
                                                   : " is outside [" + number_text(member.min) +
                                                         ", " + number_text(member.max) + "]");
      switch (member.repair) {
        case Repair::kClamp:
          value = std::clamp(number, member.min, member.max);
          return repairs_.mended("clamped", where, std::move(fault), shown(value) + " counts");
        case Repair::kNormalize:
          return repairs_.is_strict() ? Status(invalid(where, std::move(fault))) : ok_status();
        case Repair::kKeep:
          return number < 0 ? Status(invalid(where, std::move(fault)))
                            : repairs_.mended("out_of_range", where, std::move(fault),
                                              "it is used as it is");
        default:
          return invalid(where, std::move(fault));
      }
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

  Status check_integer_map(Json& value, const SchemaMember& member, const std::string& where) {
    if (!value.is_object()) {
      return invalid(where, shown(value) + " is not an object");
    }
    if (value.size() < member.count_min) {
      return repairs_.mended("not_drawn", where, "is empty; at least one member is required",
                             "there is nothing to draw");
    }
    for (auto& [name, element] : value.items()) {
      if (auto status = check_integer(element, member, where + pointer_step(name)); !status) {
        return status;
      }
    }
    return ok_status();
  }

  Json& root_;
  GltfTables& tables_;
  GltfRepairs& repairs_;
  std::map<std::string, std::size_t> sizes_;
  std::deque<GltfPart> open_;
  bool is_unused_ = false;  ///< nothing refers to the parts that are checked
};

}  // namespace

std::string shown(const GltfJson& value) {
  constexpr std::size_t kLongest = 60;
  std::string text = value.dump(-1, ' ', true, GltfJson::error_handler_t::replace);
  return text.size() > kLongest ? text.substr(0, kLongest) + "..." : text;
}

Status check_schemas(GltfJson& root, GltfTables& tables, GltfRepairs& repairs) {
  return SchemaWalk(root, tables, repairs).check();
}

}  // namespace core
