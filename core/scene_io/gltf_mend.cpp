#include "core/scene_io/gltf_mend.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "core/scene_io/gltf_schema_check.h"

namespace core {
namespace {

using Json = GltfJson;

/// Cosines between the columns of a matrix up to this come from rounding in writers, not from a
/// shear: no vertex moves by more than this part of its distance.
constexpr double kShearMax = 1e-3;

/// KHR_lights_punctual requires inner < outer. Cones that are equal in the file keep a soft edge of
/// this part of the outer one.
constexpr double kSoftEdge = 1e-4;

std::string at(const char* array, std::size_t i) {
  return std::string("/") + array + "/" + std::to_string(i);
}

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
      leave_out(tables, {"cameras", i}, {ErrorCode::kInvalidArgument, *fault, at("cameras", i)},
                repairs);
      camera = {{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 1}}}};
    } else if (auto status = mend_camera(camera, at("cameras", i), repairs); !status) {
      return status;
    }
  }
  return ok_status();
}

/// KHR_materials_ior allows 0, for full reflection, and values from 1 on.
Status mend_materials(Json& root, GltfRepairs& repairs) {
  Json* const materials = array_in(root, "materials");
  const Json::json_pointer place("/extensions/KHR_materials_ior/ior");
  for (std::size_t i = 0; materials != nullptr && i < materials->size(); ++i) {
    Json& material = (*materials)[i];
    if (!material.contains(place)) {
      continue;
    }
    Json& ior = material.at(place);
    if (ior == 0 || ior.get<double>() >= 1) {
      continue;
    }
    const std::string fault = shown(ior) + " is neither 0 nor at least 1";
    ior = 1;
    if (auto status =
            repairs.mended("clamped", at("materials", i) + place.to_string(), fault, "1 counts");
        !status) {
      return status;
    }
  }
  return ok_status();
}

Status mend_spots(Json& root, GltfRepairs& repairs) {
  const Json::json_pointer place("/extensions/KHR_lights_punctual/lights");
  if (!root.contains(place)) {
    return ok_status();
  }
  Json& lights = root.at(place);
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const std::string where = place.to_string() + "/" + std::to_string(i) + "/spot";
    const auto spot = lights[i].find("spot");
    if (lights[i].at("type") != "spot" || spot == lights[i].end()) {
      continue;
    }
    constexpr double kQuarter = 0.7853981633974483;  // the default of outerConeAngle
    const double outer = spot->value("outerConeAngle", kQuarter);
    const double inner = spot->value("innerConeAngle", 0.0);
    if (inner < outer || !(outer > 0)) {
      continue;
    }
    (*spot)["innerConeAngle"] = outer * (1 - kSoftEdge);
    if (auto status =
            repairs.mended("clamped", where, "innerConeAngle must be less than outerConeAngle",
                           "the cone has a hard edge at outerConeAngle");
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
                   at("animations", a) + "/channels/" + std::to_string(c) + "/sampler"},
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
  if (repairs.is_strict()) {
    return mend_cameras(root, tables, repairs);  // The schema refuses the others.
  }
  Json* const nodes = array_in(root, "nodes");
  for (std::size_t i = 0; nodes != nullptr && i < nodes->size(); ++i) {
    if (auto status = mend_node((*nodes)[i], at("nodes", i), repairs); !status) {
      return status;
    }
  }
  if (auto status = mend_cameras(root, tables, repairs); !status) {
    return status;
  }
  mend_animations(root, tables, repairs);
  if (auto status = mend_materials(root, repairs); !status) {
    return status;
  }
  return mend_spots(root, repairs);
}

Status take_animated_matrices_apart(GltfJson& root, GltfRepairs& repairs) {
  for (const auto& [index, parts] : animated_parts(root)) {
    Json& node = root.at("nodes").at(index);
    if (!node.contains("matrix")) {
      continue;
    }
    const std::string where = at("nodes", index) + "/matrix";
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
