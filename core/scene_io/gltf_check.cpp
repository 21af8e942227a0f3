#include "core/scene_io/gltf_check.h"

#include <algorithm>

#include <nlohmann/json.hpp>

#include "core/base/invalid.h"
#include "core/scene_io/gltf_json.h"
#include "core/scene_io/gltf_mend.h"
#include "core/scene_io/gltf_pointer.h"
#include "core/scene_io/gltf_schema.h"
#include "core/scene_io/gltf_schema_check.h"

namespace core {
namespace {

using Json = GltfJson;

/// "byte 26 (line 2, column 7)"; lines and columns count from 1.
std::string place_of(std::string_view text, std::size_t offset) {
  const std::string_view before = text.substr(0, offset);
  const std::size_t line_begin = before.rfind('\n') + 1;  // npos + 1 is 0
  return "byte " + std::to_string(offset) + " (line " +
         std::to_string(1 + std::count(before.begin(), before.end(), '\n')) + ", column " +
         std::to_string(before.size() - line_begin + 1) + ")";
}

std::uint64_t unsigned_or(const Json& object, const char* name, std::uint64_t otherwise) {
  const auto it = object.find(name);
  return it == object.end() ? otherwise : it->get<std::uint64_t>();
}
int index_or_none(const Json& object, const char* name) {
  const auto it = object.find(name);
  return it == object.end() ? -1 : it->get<int>();
}

Status check_asset(const Json& root) {
  const auto version = root.at("asset").at("version").get<std::string>();
  if (!version.starts_with("2.")) {
    return invalid("/asset/version", "glTF version " + shown(Json(version)) + "; 2.0 is read");
  }
  const auto minimum = root.at("asset").value("minVersion", std::string("2.0"));
  if (minimum != "2.0") {
    return invalid("/asset/minVersion", "the file requires a reader of version " +
                                            shown(Json(minimum)) + "; this is 2.0");
  }
  return ok_status();
}

Status check_extensions(const Json& root, GltfRepairs& repairs) {
  const Json none = Json::array();
  const auto required = root.find("extensionsRequired");
  const Json& needed = required == root.end() ? none : *required;
  for (std::size_t i = 0; i < needed.size(); ++i) {
    const auto name = needed[i].get<std::string>();
    if (!is_supported_extension(name)) {
      return invalid(
          "/extensionsRequired/" + std::to_string(i),
          "the file requires the extension " + shown(needed[i]) + ", which is not supported");
    }
  }
  const auto used = root.find("extensionsUsed");
  const Json& names = used == root.end() ? none : *used;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!is_supported_extension(names[i].get<std::string>())) {
      repairs.note("extension_ignored", "/extensionsUsed/" + std::to_string(i),
                   "extension " + shown(names[i]) + " is used by the file and was ignored");
    }
  }
  return ok_status();
}

// tinygltf would use the matrix and silently ignore the rest.
Status check_node_transforms(const Json& root) {
  const auto nodes = root.find("nodes");
  for (std::size_t i = 0; nodes != root.end() && i < nodes->size(); ++i) {
    const Json& node = (*nodes)[i];
    if (node.contains("matrix") &&
        (node.contains("translation") || node.contains("rotation") || node.contains("scale"))) {
      return invalid("/nodes/" + std::to_string(i),
                     "a node may have a matrix, or translation, rotation and scale, not both");
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

/// Parts that were left out stay empty.
void read_tables(const Json& root, GltfTables& tables) {
  for (const Json& json : array_of(root, "buffers")) {
    GltfBuffer& buffer = tables.buffers.emplace_back();
    if (tables.fault_of("buffers", static_cast<int>(tables.buffers.size()) - 1) != nullptr) {
      continue;
    }
    buffer.bytes = json.at("byteLength").get<std::uint64_t>();
    if (const auto uri = json.find("uri"); uri != json.end()) {
      buffer.uri = uri->get<std::string>();
    }
    const Json* meshopt = extension(json, "EXT_meshopt_compression");
    buffer.is_meshopt_fallback = meshopt != nullptr && meshopt->value("fallback", false);
  }
  for (const Json& json : array_of(root, "bufferViews")) {
    GltfView& view = tables.views.emplace_back();
    if (tables.fault_of("bufferViews", static_cast<int>(tables.views.size()) - 1) != nullptr) {
      continue;
    }
    view.buffer = json.at("buffer").get<int>();
    view.offset = unsigned_or(json, "byteOffset", 0);
    view.bytes = json.at("byteLength").get<std::uint64_t>();
    view.stride = unsigned_or(json, "byteStride", 0);
    if (const Json* meshopt = extension(json, "EXT_meshopt_compression")) {
      view.meshopt = read_meshopt(*meshopt);
    }
  }
  for (const Json& json : array_of(root, "accessors")) {
    const auto index = static_cast<int>(tables.accessors.size());
    tables.accessors.push_back(tables.fault_of("accessors", index) == nullptr ? read_accessor(json)
                                                                              : GltfAccessor());
  }
  for (const Json& json : array_of(root, "images")) {
    GltfImage& image = tables.images.emplace_back();
    if (tables.fault_of("images", static_cast<int>(tables.images.size()) - 1) != nullptr) {
      continue;
    }
    image.name = json.value("name", std::string());
    image.media_type = json.value("mimeType", std::string());
    image.view = index_or_none(json, "bufferView");
    if (const auto uri = json.find("uri"); uri != json.end()) {
      image.uri = uri->get<std::string>();
    }
  }
  if (const Json* profiles = extension(root, "EXT_lights_ies")) {
    for (const Json& json : profiles->at("lights")) {
      GltfProfile& profile = tables.profiles.emplace_back();
      profile.view = index_or_none(json, "bufferView");
      if (const auto uri = json.find("uri"); uri != json.end()) {
        profile.uri = uri->get<std::string>();
      }
    }
  }
}

// Removes input that crashes tinygltf 2.7 to 2.9: index accessors without a view, channels without
// a node (both valid), and everything that holds bytes.
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

Result<CheckedGltf> check_document(Json& root, const GltfContainer& container,
                                   GltfRepairs& repairs) {
  CheckedGltf checked;
  if (auto status = check_schemas(root, checked.tables, repairs); !status) {
    return status.error();
  }
  if (auto status = check_asset(root); !status) {
    return status.error();
  }
  if (auto status = mend_document(root, checked.tables, repairs); !status) {
    return status.error();
  }
  if (auto status = check_node_transforms(root); !status) {
    return status.error();
  }
  if (auto status = check_extensions(root, repairs); !status) {
    return status.error();
  }
  read_tables(root, checked.tables);
  if (auto status = check_tables(checked.tables, container, repairs); !status) {
    return status.error();
  }
  if (auto status = read_pointers(root, checked.tables, repairs); !status) {
    return status.error();
  }
  if (auto status = take_animated_matrices_apart(root, repairs); !status) {
    return status.error();
  }
  reduce_for_tinygltf(root);
  checked.model_json = root.dump();
  return checked;
}

}  // namespace

Result<CheckedGltf> check_gltf(const GltfContainer& container, GltfRepairs& repairs) {
  try {
    Json root = Json::parse(container.json);
    return check_document(root, container, repairs);
  } catch (const Json::parse_error& problem) {
    // Omits the parser's own message, which quotes the input.
    return invalid("", "the glTF JSON cannot be read: it is not JSON from " +
                           place_of(container.json, problem.byte > 0 ? problem.byte - 1 : 0) +
                           " on");
  } catch (const Json::out_of_range&) {
    return invalid("", "the glTF JSON cannot be read: a number is out of range");
  } catch (const Json::exception&) {
    return invalid("", "the glTF JSON cannot be read");
  }
}

}  // namespace core
