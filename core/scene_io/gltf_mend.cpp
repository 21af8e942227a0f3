#include "core/scene_io/gltf_mend.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/scene_io/gltf_schema_check.h"

namespace core {
namespace {

using Json = GltfJson;

/// Cosines between the columns of a matrix up to this come from rounding in writers, not from a
/// shear: no vertex moves by more than this part of its distance.
constexpr double kShearMax = 1e-3;

/// KHR_lights_punctual requires inner < outer. Cones that are equal in the file keep a soft edge of
/// this part of the outer one; if that is 0, this many radians count.
constexpr double kSoftEdge = 1e-4;

Json* array_in(Json& root, const char* name) {
  const auto it = root.find(name);
  return it == root.end() ? nullptr : &*it;
}

bool is_list_of(const Json& object, const char* name, const Json& numbers) {
  const auto it = object.find(name);
  return it == object.end() || *it == numbers;
}

Status mend_node(Json& node, const std::string& where, GltfRepairs& repairs) {
  if (node.contains("skin") && !node.contains("mesh")) {
    node.erase("skin");
    if (auto status = repairs.mended("left_out", where, "a node with a skin needs a mesh",
                                     "the skin is ignored");
        !status) {
      return status;
    }
  }
  const bool has_parts =
      node.contains("translation") || node.contains("rotation") || node.contains("scale");
  if (!node.contains("matrix") || !has_parts) {
    return ok_status();
  }
  const bool parts_do_nothing = is_list_of(node, "translation", {0, 0, 0}) &&
                                is_list_of(node, "rotation", {0, 0, 0, 1}) &&
                                is_list_of(node, "scale", {1, 1, 1});
  const bool matrix_does_nothing =
      node.at("matrix") == Json{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  if (!parts_do_nothing && !matrix_does_nothing) {
    return ok_status();  // refused later
  }
  if (parts_do_nothing) {
    for (const char* name : {"translation", "rotation", "scale"}) {
      node.erase(name);
    }
  } else {
    node.erase("matrix");
  }
  return repairs.mended("left_out", where,
                        "a node may have a matrix, or translation, rotation and scale, not both",
                        "those that do nothing are ignored");
}

/// Returns why a camera has no meaning.
std::optional<std::string> fault_of_camera(const Json& camera) {
  const auto type = camera.at("type").get<std::string>();
  const auto shape = camera.find(type);
  if (shape == camera.end()) {
    return "the camera has no " + type + " object";
  }
  if (type == "orthographic" && (shape->at("xmag") == 0 || shape->at("ymag") == 0)) {
    return std::string("the camera has no orthographic object with xmag and ymag other than 0");
  }
  return std::nullopt;
}

Status mend_camera(Json& camera, const std::string& where, GltfRepairs& repairs) {
  const auto type = camera.at("type").get<std::string>();
  Json& shape = camera.at(type);
  const auto zfar = shape.find("zfar");
  if (zfar == shape.end() || zfar->get<double>() > shape.at("znear").get<double>()) {
    return ok_status();
  }
  const std::string fault = shown(*zfar) + " is not above the znear of " + shown(shape.at("znear"));
  *zfar = 3.4e38;
  return repairs.mended("left_out", where + "/" + type + "/zfar", fault, "there is no far plane");
}

Status mend_cameras(Json& root, GltfTables& tables, GltfRepairs& repairs) {
  Json* const cameras = array_in(root, "cameras");
  for (std::size_t i = 0; cameras != nullptr && i < cameras->size(); ++i) {
    Json& camera = (*cameras)[i];
    if (const auto fault = fault_of_camera(camera)) {
      leave_out(tables, {"cameras", i},
                {ErrorCode::kInvalidArgument, *fault, pointer_of("cameras", i)}, repairs);
      camera = {{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 1}}}};
    } else if (auto status = mend_camera(camera, pointer_of("cameras", i), repairs); !status) {
      return status;
    }
  }
  return ok_status();
}

/// KHR_materials_ior allows 0, for full reflection, and values from 1 on.
Status mend_ior(Json& material, const std::string& where, GltfRepairs& repairs) {
  const Json::json_pointer place("/extensions/KHR_materials_ior/ior");
  if (!material.contains(place)) {
    return ok_status();
  }
  Json& ior = material.at(place);
  if (ior == 0 || ior.get<double>() >= 1) {
    return ok_status();
  }
  const std::string fault = shown(ior) + " is neither 0 nor at least 1";
  ior = 1;
  return repairs.mended("clamped", where + place.to_string(), fault, "1 counts");
}

Status mend_attenuation(Json& material, const std::string& where, GltfRepairs& repairs) {
  const Json::json_pointer place("/extensions/KHR_materials_volume/attenuationDistance");
  if (!material.contains(place) || material.at(place).get<double>() > 0) {
    return ok_status();
  }
  const std::string fault = shown(material.at(place)) + " is not above 0";
  material.at(place.parent_pointer()).erase(place.back());
  return repairs.mended("left_out", where + place.to_string(), fault, "nothing is absorbed");
}

Status mend_materials(Json& root, GltfRepairs& repairs) {
  Json* const materials = array_in(root, "materials");
  for (std::size_t i = 0; materials != nullptr && i < materials->size(); ++i) {
    const std::string where = pointer_of("materials", i);
    Status status = mend_attenuation((*materials)[i], where, repairs);
    if (status && !repairs.is_strict()) {  // Strict reading refuses another ior later.
      status = mend_ior((*materials)[i], where, repairs);
    }
    if (!status) {
      return status;
    }
  }
  return ok_status();
}

/// Integers of these attributes must be normalised (glTF 2.0, 3.7.2.1); KHR_mesh_quantization lifts
/// that for texture coordinates.
Status mend_attributes(const Json& attributes, bool is_quantized, Json& accessors,
                       GltfRepairs& repairs) {
  for (const auto& [name, index] : attributes.items()) {
    const bool must_be_normalized = name.starts_with("COLOR_") || name.starts_with("WEIGHTS_") ||
                                    (name.starts_with("TEXCOORD_") && !is_quantized);
    if (!must_be_normalized || index.get<std::size_t>() >= accessors.size()) {
      continue;
    }
    Json& accessor = accessors[index.get<std::size_t>()];
    const int type = accessor.value("componentType", 0);
    const bool is_integer = type == 5120 || type == 5121 || type == 5122 || type == 5123;
    if (!is_integer || accessor.value("normalized", false)) {
      continue;
    }
    accessor["normalized"] = true;
    if (auto status = repairs.mended("missing", pointer_of("accessors", index.get<std::size_t>()),
                                     "integers of " + name + " must be normalized",
                                     "they count as normalized");
        !status) {
      return status;
    }
  }
  return ok_status();
}

Status mend_meshes(Json& root, GltfRepairs& repairs) {
  Json* const meshes = array_in(root, "meshes");
  Json* const accessors = array_in(root, "accessors");
  bool is_quantized = false;
  for (const char* list : {"extensionsUsed", "extensionsRequired"}) {
    const Json* const names = array_in(root, list);
    is_quantized =
        is_quantized || (names != nullptr && std::find(names->begin(), names->end(),
                                                       "KHR_mesh_quantization") != names->end());
  }
  for (std::size_t m = 0; meshes != nullptr && accessors != nullptr && m < meshes->size(); ++m) {
    for (const Json& primitive : (*meshes)[m].at("primitives")) {
      std::vector<Json> all(1, primitive.at("attributes"));
      if (const auto targets = primitive.find("targets"); targets != primitive.end()) {
        all.insert(all.end(), targets->begin(), targets->end());
      }
      for (const Json& attributes : all) {
        if (auto status = mend_attributes(attributes, is_quantized, *accessors, repairs); !status) {
          return status;
        }
      }
    }
  }
  return ok_status();
}

/// Gives the object as many weights as there are morph targets.
Status mend_weights(Json& object, std::size_t targets, const std::string& where,
                    GltfRepairs& repairs) {
  Json* const weights = array_in(object, "weights");
  const std::size_t count = weights == nullptr ? targets : weights->size();
  if (count == targets) {
    return ok_status();
  }
  weights->get_ref<Json::array_t&>().resize(targets, 0);
  return repairs.mended(
      count < targets ? "missing" : "left_out", where + "/weights",
      "there must be as many weights as morph targets, " + std::to_string(targets) + ", not " +
          std::to_string(count),
      count < targets ? "those of the last targets are 0" : "the last weights are left out");
}

/// Those of nodes count instead of those of their mesh.
Status mend_all_weights(Json& root, GltfRepairs& repairs) {
  Json* const meshes = array_in(root, "meshes");
  Json* const nodes = array_in(root, "nodes");
  const auto targets_of = [](const Json& mesh) {
    const Json::json_pointer first("/primitives/0/targets");  // a mesh that is left out has none
    return mesh.contains(first) ? mesh.at(first).size() : 0;
  };
  Status status = ok_status();
  for (std::size_t m = 0; status && meshes != nullptr && m < meshes->size(); ++m) {
    status = mend_weights((*meshes)[m], targets_of((*meshes)[m]), pointer_of("meshes", m), repairs);
  }
  for (std::size_t n = 0; status && nodes != nullptr && n < nodes->size(); ++n) {
    Json& node = (*nodes)[n];
    const auto mesh = node.value("mesh", std::numeric_limits<std::size_t>::max());
    if (meshes != nullptr && mesh < meshes->size()) {
      status = mend_weights(node, targets_of((*meshes)[mesh]), pointer_of("nodes", n), repairs);
    }
  }
  return status;
}

Status mend_spots(Json& root, GltfRepairs& repairs) {
  const Json::json_pointer place("/extensions/KHR_lights_punctual/lights");
  if (!root.contains(place)) {
    return ok_status();
  }
  Json& lights = root.at(place);
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const std::string where = place.to_string() + "/" + std::to_string(i) + "/spot";
    if (lights[i].at("type") != "spot") {
      continue;
    }
    if (!lights[i].contains("spot")) {
      lights[i]["spot"] = Json::object();
      if (auto status =
              repairs.mended("missing", where, "a spot light must have an object \"spot\"",
                             "its angles are the defaults");
          !status) {
        return status;
      }
    }
    Json& spot = lights[i].at("spot");
    constexpr double kQuarter = 0.7853981633974483;  // the default of outerConeAngle
    const double outer = spot.value("outerConeAngle", kQuarter);
    const double inner = spot.value("innerConeAngle", 0.0);
    if (inner < outer) {
      continue;
    }
    const double mended = outer > 0 ? outer : kSoftEdge;
    spot["outerConeAngle"] = mended;
    spot["innerConeAngle"] = mended * (1 - kSoftEdge);
    if (auto status =
            repairs.mended("clamped", where, "innerConeAngle must be less than outerConeAngle",
                           outer > 0 ? "the cone has a hard edge at outerConeAngle"
                                     : "the cone is as narrow as can be");
        !status) {
      return status;
    }
  }
  return ok_status();
}

/// An animation whose channel has no sampler is left out.
void mend_animations(Json& root, GltfTables& tables, GltfRepairs& repairs) {
  Json* const animations = array_in(root, "animations");
  for (std::size_t a = 0; animations != nullptr && a < animations->size(); ++a) {
    Json& animation = (*animations)[a];
    const std::size_t samplers = animation.at("samplers").size();
    for (std::size_t c = 0; c < animation.at("channels").size(); ++c) {
      const auto sampler = animation.at("channels")[c].at("sampler").get<std::size_t>();
      if (sampler >= samplers) {
        leave_out(tables, {"animations", a},
                  {ErrorCode::kInvalidArgument,
                   std::to_string(sampler) + " names none of the " + std::to_string(samplers) +
                       " samplers",
                   pointer_of("animations", a) + "/channels/" + std::to_string(c) + "/sampler"},
                  repairs);
        animation["channels"] = Json::array();
        animation["samplers"] = Json::array();
      }
    }
  }
}

using Column = std::array<double, 3>;

double dot(const Column& a, const Column& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Column cross(const Column& a, const Column& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Returns the unit quaternion x, y, z, w of a rotation given by its columns. Source: S. W.
/// Shepperd, Quaternion from Rotation Matrix, 1978: the largest component first.
std::array<double, 4> quaternion_of(const std::array<Column, 3>& m) {
  const std::array<double, 4> squares = {
      1 + m[0][0] - m[1][1] - m[2][2], 1 - m[0][0] + m[1][1] - m[2][2],
      1 - m[0][0] - m[1][1] + m[2][2], 1 + m[0][0] + m[1][1] + m[2][2]};
  std::size_t k = 0;
  for (std::size_t i = 1; i < 4; ++i) {
    k = squares[i] > squares[k] ? i : k;
  }
  const double twice = std::sqrt(squares[k]);  // 2 q[k]
  const double f = 0.5 / twice;
  std::array<double, 4> q{};
  if (k == 3) {
    q = {(m[1][2] - m[2][1]) * f, (m[2][0] - m[0][2]) * f, (m[0][1] - m[1][0]) * f, 0};
  } else {
    const std::size_t a = (k + 1) % 3;
    const std::size_t b = (k + 2) % 3;
    q[a] = (m[k][a] + m[a][k]) * f;
    q[b] = (m[k][b] + m[b][k]) * f;
    q[3] = (m[a][b] - m[b][a]) * f;
  }
  q[k] = twice / 2;
  return q;
}

/// Replaces a node's matrix by translation, rotation and scale; returns false if it shears.
bool take_apart(Json& node) {
  const auto values = node.at("matrix").get<std::array<double, 16>>();
  std::array<Column, 3> columns{};
  Column scale{};
  for (std::size_t c = 0; c < 3; ++c) {
    columns[c] = {values[4 * c], values[4 * c + 1], values[4 * c + 2]};
    scale[c] = std::sqrt(dot(columns[c], columns[c]));
    for (double& v : columns[c]) {
      v = scale[c] > 0 ? v / scale[c] : 0;
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    if (std::abs(dot(columns[c], columns[(c + 1) % 3])) > kShearMax) {
      return false;
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    if (!(scale[c] > 0)) {  // flat: any direction across the others
      columns[c] = cross(columns[(c + 1) % 3], columns[(c + 2) % 3]);
    }
  }
  if (dot(cross(columns[0], columns[1]), columns[2]) < 0) {
    scale[0] = -scale[0];
    columns[0] = {-columns[0][0], -columns[0][1], -columns[0][2]};
  }
  const bool is_turned = dot(cross(columns[0], columns[1]), columns[2]) > 0.5;  // else a line
  node["rotation"] = is_turned ? quaternion_of(columns) : std::array<double, 4>{0, 0, 0, 1};
  node["translation"] = Column{values[12], values[13], values[14]};
  node["scale"] = scale;
  node.erase("matrix");
  return true;
}

/// The animated ones of translation, rotation and scale, by node.
std::map<std::size_t, std::set<std::string>> animated_parts(Json& root) {
  std::map<std::size_t, std::set<std::string>> parts;
  Json* const animations = array_in(root, "animations");
  for (std::size_t a = 0; animations != nullptr && a < animations->size(); ++a) {
    for (const Json& channel : (*animations)[a].at("channels")) {
      const Json& target = channel.at("target");
      const auto path = target.at("path").get<std::string>();
      if (target.contains("node") &&
          (path == "translation" || path == "rotation" || path == "scale")) {
        parts[target.at("node").get<std::size_t>()].insert(path);
      }
    }
  }
  return parts;
}

}  // namespace

Status mend_document(GltfJson& root, GltfTables& tables, GltfRepairs& repairs) {
  Status status = mend_cameras(root, tables, repairs);
  status = status ? mend_materials(root, repairs) : status;
  status = status ? mend_meshes(root, repairs) : status;
  status = status ? mend_all_weights(root, repairs) : status;
  status = status ? mend_spots(root, repairs) : status;
  if (!status || repairs.is_strict()) {
    return status;  // Strict reading refuses the others later.
  }
  Json* const nodes = array_in(root, "nodes");
  for (std::size_t i = 0; nodes != nullptr && i < nodes->size(); ++i) {
    if (status = mend_node((*nodes)[i], pointer_of("nodes", i), repairs); !status) {
      return status;
    }
  }
  mend_animations(root, tables, repairs);
  return ok_status();
}

Status take_animated_matrices_apart(GltfJson& root, GltfRepairs& repairs) {
  for (const auto& [index, parts] : animated_parts(root)) {
    Json& node = root.at("nodes").at(index);
    if (!node.contains("matrix")) {
      continue;
    }
    const std::string where = pointer_of("nodes", index) + "/matrix";
    const std::string fault = "an animated node has translation, rotation and scale, no matrix";
    const bool is_replaced = parts.size() == 3;
    if (is_replaced) {
      node.erase("matrix");
    } else if (!take_apart(node) && !repairs.is_strict()) {
      return Error{ErrorCode::kInvalidArgument,
                   fault + "; this one shears, so it is not a product of the three", where};
    }
    if (auto status =
            repairs.mended("decomposed", where, fault,
                           is_replaced ? "all three are animated, so it is ignored"
                                       : "it is taken apart, and keeps what is not animated");
        !status) {
      return status;
    }
  }
  return ok_status();
}

}  // namespace core
