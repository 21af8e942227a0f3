#include "core/scene_io/gltf_check.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include <nlohmann/json.hpp>

#include "core/scene_io/gltf_schema.h"

namespace core {
namespace {

using Json = nlohmann::json;

// Numbers up to 2^53 are exact in JSON readers; file offsets never come near.
constexpr double kIntegerMax = 9007199254740992.0;
constexpr double kNumberMax = 3.4e38;  // FLT_MAX, rounded down

Error invalid(std::string where, std::string message) {
  return {ErrorCode::kInvalidArgument, std::move(message), std::move(where)};
}

std::string shown(const Json& value) {
  constexpr std::size_t kLongest = 60;
  std::string text = value.dump(-1, ' ', true, Json::error_handler_t::replace);
  return text.size() > kLongest ? text.substr(0, kLongest) + "..." : text;
}

std::string shown(double v) {
  const bool whole = v == std::floor(v) && std::abs(v) < kIntegerMax;
  return whole ? Json(static_cast<std::int64_t>(v)).dump() : Json(v).dump();
}

/// "byte 26 (line 2, column 7)"; lines and columns count from 1.
std::string place_of(std::string_view text, std::size_t offset) {
  const std::string_view before = text.substr(0, offset);
  const std::size_t line_begin = before.rfind('\n') + 1;  // npos + 1 is 0
  return "byte " + std::to_string(offset) + " (line " +
         std::to_string(1 + std::count(before.begin(), before.end(), '\n')) + ", column " +
         std::to_string(before.size() - line_begin + 1) + ")";
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

std::uint64_t unsigned_or(const Json& object, const char* name, std::uint64_t otherwise) {
  const auto it = object.find(name);
  return it == object.end() ? otherwise : it->get<std::uint64_t>();
}
int index_or_none(const Json& object, const char* name) {
  const auto it = object.find(name);
  return it == object.end() ? -1 : it->get<int>();
}

/// Walks the document along the schemas. Integers that are written as 5.0 become 5 on the way.
class SchemaWalk {
 public:
  explicit SchemaWalk(Json& root) : root_(root) {
    for (const char* name :
         {"accessors", "animations", "buffers", "bufferViews", "cameras", "images", "materials",
          "meshes", "nodes", "samplers", "scenes", "skins", "textures"}) {
      sizes_[name] = array_size(Json::json_pointer(std::string("/") + name));
    }
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
        break;
    }
    if (!value.is_array()) {
      return invalid(where, shown(value) + " is not an array");
    }
    if (value.size() < member.count_min || value.size() > member.count_max) {
      return invalid(where, std::to_string(value.size()) + " elements; there have to be " +
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
      default:
        return check_object(value, member.child, where);
    }
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
        return invalid(where, shown(value) + " names none of the " + shown(size) + " " +
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
      return invalid(where, shown(value) + (no_upper ? " is below " + shown(member.min)
                                                     : " is outside [" + shown(member.min) + ", " +
                                                           shown(member.max) + "]"));
    }
    if (!member.one_of.empty() && !is_one_of(shown(value), member.one_of)) {
      return invalid(where, shown(value) + " is none of " + list_of(member.one_of));
    }
    return ok_status();
  }

  static Status check_string(const Json& value, const SchemaMember& member,
                             const std::string& where) {
    if (!value.is_string()) {
      return invalid(where, shown(value) + " is not a string");
    }
    if (!member.one_of.empty() && !is_one_of(value.get_ref<const std::string&>(), member.one_of)) {
      return invalid(where, shown(value) + " is none of " + list_of(member.one_of));
    }
    return ok_status();
  }

  Status check_integer_map(Json& value, const SchemaMember& member,
                           const std::string& where) const {
    if (!value.is_object()) {
      return invalid(where, shown(value) + " is not an object");
    }
    if (value.size() < member.count_min) {
      return invalid(where, "is empty; there has to be a member");
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

Status check_asset(const Json& root) {
  const auto version = root.at("asset").at("version").get<std::string>();
  if (!version.starts_with("2.")) {
    return invalid("/asset/version", "glTF version " + shown(Json(version)) + "; 2.0 is read");
  }
  const auto minimum = root.at("asset").value("minVersion", std::string("2.0"));
  if (minimum != "2.0") {
    return invalid("/asset/minVersion", "the file asks for a reader of version " +
                                            shown(Json(minimum)) + "; this is 2.0");
  }
  return ok_status();
}

Status check_extensions(const Json& root, std::vector<std::string>& warnings) {
  const Json none = Json::array();
  const auto required = root.find("extensionsRequired");
  const Json& needed = required == root.end() ? none : *required;
  for (std::size_t i = 0; i < needed.size(); ++i) {
    const auto name = needed[i].get<std::string>();
    if (name == "KHR_texture_basisu") {
      return invalid("/extensionsRequired/" + std::to_string(i),
                     "KHR_texture_basisu (KTX2 textures) is not available; convert the textures to "
                     "PNG, JPEG or WebP");
    }
    if (!is_supported_extension(name)) {
      return invalid(
          "/extensionsRequired/" + std::to_string(i),
          "the file requires the extension " + shown(needed[i]) + ", which is not supported");
    }
  }
  const auto used = root.find("extensionsUsed");
  for (const Json& name : used == root.end() ? none : *used) {
    const auto text = name.get<std::string>();
    if (!is_supported_extension(text) && text != "KHR_texture_basisu") {
      warnings.push_back("extension " + shown(name) + " is used by the file and was ignored");
    }
  }
  return ok_status();
}

// tinygltf would take the matrix and drop the rest without a word.
Status check_node_transforms(const Json& root) {
  const auto nodes = root.find("nodes");
  for (std::size_t i = 0; nodes != root.end() && i < nodes->size(); ++i) {
    const Json& node = (*nodes)[i];
    if (node.contains("matrix") &&
        (node.contains("translation") || node.contains("rotation") || node.contains("scale"))) {
      return invalid("/nodes/" + std::to_string(i),
                     "a node has a matrix, or translation, rotation and scale, not both");
    }
  }
  return ok_status();
}

const Json* extension(const Json& object, const char* name) {
  const auto extensions = object.find("extensions");
  if (extensions == object.end()) {
    return nullptr;
  }
  const auto it = extensions->find(name);
  return it == extensions->end() ? nullptr : &*it;
}

const Json& array_of(const Json& root, const char* name) {
  static const Json kNone = Json::array();
  const auto it = root.find(name);
  return it == root.end() ? kNone : *it;
}

GltfMeshopt read_meshopt(const Json& json) {
  const auto mode = json.at("mode").get<std::string>();
  const auto filter = json.value("filter", std::string("NONE"));
  return {.buffer = json.at("buffer").get<int>(),
          .offset = unsigned_or(json, "byteOffset", 0),
          .bytes = json.at("byteLength").get<std::uint64_t>(),
          .stride = json.at("byteStride").get<std::uint64_t>(),
          .count = json.at("count").get<std::uint64_t>(),
          .mode = mode == "ATTRIBUTES"  ? MeshoptMode::kAttributes
                  : mode == "TRIANGLES" ? MeshoptMode::kTriangles
                                        : MeshoptMode::kIndices,
          .filter = filter == "OCTAHEDRAL"    ? MeshoptFilter::kOctahedral
                    : filter == "QUATERNION"  ? MeshoptFilter::kQuaternion
                    : filter == "EXPONENTIAL" ? MeshoptFilter::kExponential
                                              : MeshoptFilter::kNone};
}

ElementShape read_shape(const std::string& type) {
  if (type == "SCALAR") {
    return {1, 1};
  }
  const int size = type.back() - '0';
  return type.starts_with("MAT") ? ElementShape{size, size} : ElementShape{size, 1};
}

GltfAccessor read_accessor(const Json& json) {
  GltfAccessor accessor = {
      .view = index_or_none(json, "bufferView"),
      .offset = unsigned_or(json, "byteOffset", 0),
      .count = json.at("count").get<std::uint64_t>(),
      .component = ComponentType{json.at("componentType").get<std::uint16_t>()},
      .shape = read_shape(json.at("type").get<std::string>()),
      .normalized = json.value("normalized", false),
      .sparse = {}};
  if (const auto sparse = json.find("sparse"); sparse != json.end()) {
    const Json& indices = sparse->at("indices");
    const Json& values = sparse->at("values");
    accessor.sparse = {
        .count = sparse->at("count").get<std::uint64_t>(),
        .indices_view = indices.at("bufferView").get<int>(),
        .indices_offset = unsigned_or(indices, "byteOffset", 0),
        .indices_type = ComponentType{indices.at("componentType").get<std::uint16_t>()},
        .values_view = values.at("bufferView").get<int>(),
        .values_offset = unsigned_or(values, "byteOffset", 0)};
  }
  return accessor;
}

GltfTables read_tables(const Json& root) {
  GltfTables tables;
  for (const Json& json : array_of(root, "buffers")) {
    GltfBuffer& buffer = tables.buffers.emplace_back();
    buffer.bytes = json.at("byteLength").get<std::uint64_t>();
    if (const auto uri = json.find("uri"); uri != json.end()) {
      buffer.uri = uri->get<std::string>();
    }
    const Json* meshopt = extension(json, "EXT_meshopt_compression");
    buffer.is_meshopt_fallback = meshopt != nullptr && meshopt->value("fallback", false);
  }
  for (const Json& json : array_of(root, "bufferViews")) {
    GltfView& view = tables.views.emplace_back();
    view.buffer = json.at("buffer").get<int>();
    view.offset = unsigned_or(json, "byteOffset", 0);
    view.bytes = json.at("byteLength").get<std::uint64_t>();
    view.stride = unsigned_or(json, "byteStride", 0);
    if (const Json* meshopt = extension(json, "EXT_meshopt_compression")) {
      view.meshopt = read_meshopt(*meshopt);
    }
  }
  for (const Json& json : array_of(root, "accessors")) {
    tables.accessors.push_back(read_accessor(json));
  }
  for (const Json& json : array_of(root, "images")) {
    GltfImage& image = tables.images.emplace_back();
    image.name = json.value("name", std::string());
    image.view = index_or_none(json, "bufferView");
    if (const auto uri = json.find("uri"); uri != json.end()) {
      image.uri = uri->get<std::string>();
    }
  }
  return tables;
}

// Input that crashes tinygltf 2.7 to 2.9: index accessors without a view, channels without a
// node (both valid), and everything that holds bytes.
void reduce_for_tinygltf(Json& root) {
  root.erase("buffers");
  root.erase("images");
  if (root.contains("accessors")) {
    const Json stub = {
        {"bufferView", 0}, {"componentType", 5121}, {"count", 1}, {"type", "SCALAR"}};
    root["bufferViews"] = Json::array({{{"buffer", 0}, {"byteLength", 1}}});
    root["accessors"] = Json::array_t(root["accessors"].size(), stub);
  } else {
    root.erase("bufferViews");
  }
  if (const auto animations = root.find("animations"); animations != root.end()) {
    for (Json& animation : *animations) {
      auto& channels = animation["channels"].get_ref<Json::array_t&>();
      std::erase_if(channels,
                    [](const Json& channel) { return !channel["target"].contains("node"); });
    }
  }
}

Result<CheckedGltf> check_document(Json& root, const GltfContainer& container) {
  if (auto status = SchemaWalk(root).check(); !status) {
    return status.error();
  }
  if (auto status = check_asset(root); !status) {
    return status.error();
  }
  if (auto status = check_node_transforms(root); !status) {
    return status.error();
  }
  CheckedGltf checked;
  if (auto status = check_extensions(root, checked.warnings); !status) {
    return status.error();
  }
  checked.tables = read_tables(root);
  if (auto status = check_tables(checked.tables, container); !status) {
    return status.error();
  }
  reduce_for_tinygltf(root);
  checked.model_json = root.dump();
  return checked;
}

}  // namespace

Result<CheckedGltf> check_gltf(const GltfContainer& container) {
  try {
    Json root = Json::parse(container.json);
    return check_document(root, container);
  } catch (const Json::parse_error& problem) {
    // Without the parser's own message, which quotes the input.
    return invalid("", "the glTF JSON cannot be read: it is not JSON from " +
                           place_of(container.json, problem.byte > 0 ? problem.byte - 1 : 0) +
                           " on");
  } catch (const Json::out_of_range&) {
    return invalid("", "the glTF JSON cannot be read: it has a number beyond all range");
  } catch (const Json::exception&) {
    return invalid("", "the glTF JSON cannot be read");
  }
}

}  // namespace core
