#include "core/scene_io/gltf_primitive.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "core/base/invalid.h"
#include "core/scene_io/gltf_accessor.h"
#include "core/scene_io/gltf_draco.h"
#include "core/scene_io/gltf_model.h"

namespace core {
namespace {

using Indices = std::vector<std::uint32_t>;

// Converts strips and fans to triangle lists, glTF 2.0 section 3.7.2.1. Skips degenerate triangles,
// whose repeated vertices join strips.
Indices triangle_list(const Indices& in, int mode) {
  if (mode == TINYGLTF_MODE_TRIANGLES) {
    return Indices(in.begin(), in.begin() + static_cast<std::ptrdiff_t>(in.size() / 3 * 3));
  }
  Indices out;
  for (std::size_t i = 0; i + 2 < in.size(); ++i) {
    const bool strip = mode == TINYGLTF_MODE_TRIANGLE_STRIP;
    const std::array<std::uint32_t, 3> t =
        strip ? std::array{in[i], in[i + 1 + i % 2], in[i + 2 - i % 2]}
              : std::array{in[i + 1], in[i + 2], in[0]};
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) {
      out.insert(out.end(), t.begin(), t.end());
    }
  }
  return out;
}

/// Reads the attributes of one primitive from accessors or Draco data.
class AttributeReader {
 public:
  AttributeReader(GltfSource& source, std::optional<DracoPrimitive> draco, std::string where,
                  GltfRepairs& repairs)
      : source_(source), draco_(std::move(draco)), where_(std::move(where)), repairs_(repairs) {}

  /// Reads vectors of an attribute: one per vertex (any number for the first attribute).
  template <typename V>
  Status read(std::vector<V>& to, const std::map<std::string, int>& attributes,
              const std::string& name, const std::string& place) {
    const auto it = attributes.find(name);
    if (it == attributes.end()) {
      return ok_status();
    }
    const std::string where = where_ + place + "/" + name;
    if (auto status = check_shape(source_, it->second,
                                  {static_cast<int>(sizeof(V) / sizeof(float)), 1}, where);
        !status) {
      return status;
    }
    auto floats = values(name, it->second, place, where);
    if (!floats) {
      return floats.error();
    }
    if (place == "/attributes") {
      note_lengths(name, *floats, where);
    }
    to = to_vectors<V>(*floats);
    return check_count(to.size(), where);
  }

  /// Reads COLOR_0 of the vertices. "All components of each COLOR_0 accessor element MUST be
  /// clamped to [0.0, 1.0] range" (glTF 2.0, 3.7.2.1).
  Status read_color(std::vector<Vec4>& to, const std::map<std::string, int>& attributes) {
    constexpr float kRounding = 0.5F / 65535;  // half a step of the finest normalised integers
    if (auto status = read_color(to, attributes, 1, "/attributes"); !status) {
      return status;
    }
    std::size_t others = 0;
    for (Vec4& c : to) {
      for (float* const v : {&c.x, &c.y, &c.z, &c.w}) {
        others += *v < -kRounding || *v > 1 + kRounding ? 1 : 0;
        *v = std::clamp(*v, 0.0F, 1.0F);
      }
    }
    return others == 0 ? ok_status()
                       : repairs_.mended("clamped", where_ + "/attributes/COLOR_0",
                                         std::to_string(others) + " values are outside [0, 1]",
                                         "the nearest number of the range counts");
  }

  /// Reads COLOR_0; colours of three values get alpha `alpha`.
  Status read_color(std::vector<Vec4>& to, const std::map<std::string, int>& attributes,
                    float alpha, const std::string& place) {
    const auto it = attributes.find("COLOR_0");
    if (it == attributes.end()) {
      return ok_status();
    }
    const auto& accessor = source_.tables().accessors[static_cast<std::size_t>(it->second)];
    if (accessor.shape.rows != 3) {
      return read(to, attributes, "COLOR_0", place);
    }
    std::vector<Vec3> rgb;
    if (auto status = read(rgb, attributes, "COLOR_0", place); !status) {
      return status;
    }
    to.clear();
    for (const Vec3 c : rgb) {
      to.push_back(Vec4{c.x, c.y, c.z, alpha});
    }
    return ok_status();
  }

  const std::optional<DracoPrimitive>& draco() const noexcept { return draco_; }
  std::size_t vertex_count() const noexcept { return vertex_count_.value_or(0); }

 private:
  Result<std::vector<float>> values(const std::string& name, int accessor, const std::string& place,
                                    const std::string& where) {
    if (draco_ && place == "/attributes") {
      const auto it = draco_->attributes.find(name);
      if (it != draco_->attributes.end()) {
        return it->second;
      }
    }
    const bool may_fail = name != "POSITION" && !name.starts_with("WEIGHTS");
    return read_floats(source_, accessor, where, may_fail ? &repairs_ : nullptr);
  }

  void note_lengths(const std::string& name, const std::vector<float>& values,
                    const std::string& where) {
    const std::size_t others = name == "NORMAL"    ? others_than_unit<3>(values)
                               : name == "TANGENT" ? others_than_unit<4, 3>(values)
                                                   : 0;
    if (others > 0) {
      repairs_.note("normalized", where,
                    std::to_string(others) +
                        " vectors are not of unit length; they are normalised, or replaced if they "
                        "are zero");
    }
  }

  Status check_count(std::size_t count, const std::string& where) {
    if (!vertex_count_) {
      vertex_count_ = count;
    }
    if (count != *vertex_count_) {
      return invalid(where, std::to_string(count) + " elements, but the primitive has " +
                                std::to_string(*vertex_count_) + " vertices");
    }
    return ok_status();
  }

  GltfSource& source_;
  std::optional<DracoPrimitive> draco_;
  std::string where_;
  GltfRepairs& repairs_;
  std::optional<std::size_t> vertex_count_;
};

Result<std::optional<DracoPrimitive>> read_draco(const tinygltf::Primitive& primitive,
                                                 GltfSource& source, const std::string& where) {
  const auto* extension = find_extension(primitive.extensions, "KHR_draco_mesh_compression");
  if (extension == nullptr) {
    return std::optional<DracoPrimitive>();
  }
  const std::string extension_where = where + "/extensions/KHR_draco_mesh_compression";
  const tinygltf::Value& ids = extension->Get("attributes");
  std::map<std::string, DracoAttribute> attributes;
  for (const std::string& name : ids.Keys()) {
    const auto it = primitive.attributes.find(name);
    if (it == primitive.attributes.end()) {
      return invalid(extension_where + "/attributes/" + name,
                     "the primitive has no such attribute");
    }
    attributes[name] = {ids.Get(name).GetNumberAsInt(), it->second};
  }
  auto draco = decode_draco(source, value_integer(*extension, "bufferView", -1), attributes,
                            extension_where);
  if (!draco) {
    return draco.error();
  }
  return std::optional<DracoPrimitive>(*std::move(draco));
}

Result<Indices> read_indices(const tinygltf::Primitive& primitive, GltfSource& source,
                             std::size_t vertices, const std::string& where) {
  Indices indices;
  if (primitive.indices < 0) {
    if (auto status = source.budget().take(vertices * sizeof(std::uint32_t), where); !status) {
      return status.error();
    }
    indices.resize(vertices);
    std::iota(indices.begin(), indices.end(), 0U);
    return indices;
  }
  if (auto status = check_shape(source, primitive.indices, {1, 1}, where + "/indices"); !status) {
    return status.error();
  }
  auto read = read_integers(source, primitive.indices, where + "/indices");
  if (!read) {
    return read.error();
  }
  const auto beyond = std::find_if(read->begin(), read->end(),
                                   [vertices](std::uint32_t i) { return i >= vertices; });
  if (beyond != read->end()) {
    return invalid(where + "/indices", "index " + std::to_string(*beyond) + " at place " +
                                           std::to_string(beyond - read->begin()) +
                                           " is not below the " + std::to_string(vertices) +
                                           " vertices");
  }
  return read;
}

std::string uv_name(int set) { return "TEXCOORD_" + std::to_string(set); }

Status read_targets(const tinygltf::Primitive& primitive, AttributeReader& reader,
                    std::array<int, 2> uv_sets, GltfPrimitive& out) {
  for (std::size_t t = 0; t < primitive.targets.size(); ++t) {
    const auto& attributes = primitive.targets[t];
    const std::string place = "/targets/" + std::to_string(t);
    MorphTarget target;
    Status status = reader.read(target.positions, attributes, "POSITION", place);
    status = status ? reader.read(target.normals, attributes, "NORMAL", place) : status;
    status = status ? reader.read(target.tangents, attributes, "TANGENT", place) : status;
    for (std::size_t k = 0; k < uv_sets.size(); ++k) {
      status = status ? reader.read(target.uv[k], attributes, uv_name(uv_sets[k]), place) : status;
    }
    status = status ? reader.read_color(target.colors, attributes, 0, place) : status;
    if (!status) {
      return status;
    }
    out.targets.push_back(std::move(target));
  }
  return ok_status();
}

Status read_joints(const tinygltf::Primitive& primitive, AttributeReader& reader,
                   GltfPrimitive& out, const std::string& where) {
  for (int set = 0;; ++set) {
    const std::string joints_name = "JOINTS_" + std::to_string(set);
    const std::string weights_name = "WEIGHTS_" + std::to_string(set);
    const bool has_joints = primitive.attributes.contains(joints_name);
    if (has_joints != primitive.attributes.contains(weights_name)) {
      return invalid(where + "/attributes",
                     joints_name + " and " + weights_name + " must be given together");
    }
    if (!has_joints) {
      return ok_status();
    }
    JointSet joint_set;
    std::vector<Vec4> joints;
    Status status = reader.read(joints, primitive.attributes, joints_name, "/attributes");
    status = status
                 ? reader.read(joint_set.weights, primitive.attributes, weights_name, "/attributes")
                 : status;
    if (!status) {
      return status;
    }
    joint_set.joints.reserve(joints.size());
    for (const Vec4 j : joints) {
      // 16-bit numbers are exact in a float; others are out of range for the skin's joints.
      const auto whole = [](float v) {
        return v >= 0 && v <= 65535 ? static_cast<std::uint32_t>(v) : ~0U;
      };
      joint_set.joints.push_back({whole(j.x), whole(j.y), whole(j.z), whole(j.w)});
    }
    out.joint_sets.push_back(std::move(joint_set));
  }
}

template <typename T>
void repeat(std::vector<T>& values, const Indices& vertices) {
  if (values.empty()) {
    return;
  }
  values.reserve(values.size() + vertices.size());
  for (const std::uint32_t v : vertices) {
    values.push_back(values[v]);
  }
}

/// Adds copies of vertices after the others.
void repeat_vertices(GltfPrimitive& primitive, const Indices& vertices) {
  const auto repeat_attributes = [&vertices](auto& of) {
    repeat(of.positions, vertices);
    repeat(of.normals, vertices);
    repeat(of.tangents, vertices);
    repeat(of.colors, vertices);
    for (std::size_t k = 0; k < of.uv.size(); ++k) {
      repeat(of.uv[k], vertices);
    }
  };
  repeat_attributes(primitive.base);
  for (MorphTarget& target : primitive.targets) {
    repeat_attributes(target);
  }
  for (JointSet& set : primitive.joint_sets) {
    repeat(set.joints, vertices);
    repeat(set.weights, vertices);
  }
}

Vec3 area_vector(const PrimitiveDescription& p, std::size_t first) {
  const Vec3 a = p.positions[p.indices[first]];
  return cross(p.positions[p.indices[first + 1]] - a, p.positions[p.indices[first + 2]] - a);
}

/// Whether all three normals of a triangle point to its back.
bool points_back(const PrimitiveDescription& p, std::size_t first) {
  const std::uint32_t* const v = &p.indices[first];
  const Vec3 a = p.positions[v[0]];
  const Vec3 front = area_vector(p, first);
  // Slivers, such as those at the poles of spheres, face anywhere: the ends of an edge are each
  // rounded by sqrt(3) 2^-24 of their distance, which is at most `far`.
  const float sides = length(p.positions[v[1]] - a) + length(p.positions[v[2]] - a);
  const float far = length(a) + sides;
  return length(front) > 0x1p-22F * far * sides &&
         std::all_of(v, v + 3, [&](std::uint32_t i) { return dot(p.normals[i], front) < 0; });
}

/// Whether triangles surround a volume and face away from it: there the normals are wrong, and of
/// others the winding, which exports of mirrored meshes forget. triangles: their first indices.
bool face_outwards(const PrimitiveDescription& p, const std::vector<std::size_t>& triangles) {
  constexpr double kOpenMost = 0.05;  // of the area, as of a vessel with a neck; a judgement
  std::array<double, 3> sum = {};     // 0 of closed surfaces
  double area = 0;
  double volume = 0;
  for (const std::size_t first : triangles) {
    const Vec3 front = area_vector(p, first);
    sum[0] += static_cast<double>(front.x);
    sum[1] += static_cast<double>(front.y);
    sum[2] += static_cast<double>(front.z);
    area += static_cast<double>(length(front));
    volume += static_cast<double>(
        dot(p.positions[p.indices[first]] - p.positions[p.indices[triangles.front()]], front));
  }
  return std::hypot(sum[0], sum[1], sum[2]) <= kOpenMost * area && volume > 0;
}

}  // namespace

Result<std::optional<GltfPrimitive>> read_primitive(const tinygltf::Primitive& primitive,
                                                    GltfSource& source, const std::string& where,
                                                    std::array<int, 2> uv_sets,
                                                    GltfRepairs& repairs) {
  const std::optional<GltfPrimitive> nothing;
  const int mode = primitive.mode < 0 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
  if (mode < TINYGLTF_MODE_TRIANGLES) {
    repairs.note("not_drawn", where, "points and lines are not drawn");
    return nothing;
  }
  if (!primitive.attributes.contains("POSITION")) {
    repairs.note("not_drawn", where, "a primitive without positions is not drawn");
    return nothing;
  }
  auto draco = read_draco(primitive, source, where);
  if (!draco) {
    return draco.error();
  }
  AttributeReader reader(source, *std::move(draco), where, repairs);
  GltfPrimitive out;
  const auto& attributes = primitive.attributes;
  Status status = reader.read(out.base.positions, attributes, "POSITION", "/attributes");
  status = status ? reader.read(out.base.normals, attributes, "NORMAL", "/attributes") : status;
  status = status ? reader.read(out.base.tangents, attributes, "TANGENT", "/attributes") : status;
  for (std::size_t k = 0; k < uv_sets.size(); ++k) {
    status = status ? reader.read(out.base.uv[k], attributes, uv_name(uv_sets[k]), "/attributes")
                    : status;
  }
  status = status ? reader.read_color(out.base.colors, attributes) : status;
  status = status ? read_targets(primitive, reader, uv_sets, out) : status;
  status = status ? read_joints(primitive, reader, out, where) : status;
  if (!status) {
    return status.error();
  }
  if (out.base.normals.empty()) {
    out.base.tangents.clear();  // "When normals are not specified, provided tangents are ignored."
  }
  if (reader.draco()) {
    out.base.indices = reader.draco()->triangles;
  } else {
    auto indices = read_indices(primitive, source, reader.vertex_count(), where);
    if (!indices) {
      return indices.error();
    }
    if (mode == TINYGLTF_MODE_TRIANGLES && indices->size() % 3 != 0) {
      repairs.note("not_drawn", where, "the last, incomplete triangle is not drawn");
    }
    out.base.indices = triangle_list(*indices, mode);
  }
  if (out.base.indices.empty()) {
    repairs.note("not_drawn", where, "a primitive without a triangle is not drawn");
    return nothing;
  }
  return std::optional<GltfPrimitive>(std::move(out));
}

void turn_normals(GltfPrimitive& primitive) {
  PrimitiveDescription& p = primitive.base;
  if (p.normals.empty()) {
    return;
  }
  std::vector<std::size_t> turned;  // the first indices of triangles
  std::vector<bool> is_shared(p.positions.size(), false);
  for (std::size_t i = 0; i + 2 < p.indices.size(); i += 3) {
    if (points_back(p, i)) {
      turned.push_back(i);
      continue;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      is_shared[p.indices[i + k]] = true;
    }
  }
  primitive.turned = turned.size();
  if (turned.empty()) {
    return;
  }
  std::vector<bool> is_turned(p.positions.size(), false);
  std::map<std::uint32_t, std::uint32_t> copies;
  Indices copied;
  for (const std::size_t first : turned) {
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& v = p.indices[first + k];
      if (is_shared[v]) {
        const auto next = static_cast<std::uint32_t>(p.positions.size() + copied.size());
        const auto [it, is_new] = copies.try_emplace(v, next);
        if (is_new) {
          copied.push_back(v);
          is_turned.push_back(true);
        }
        v = it->second;
      } else {
        is_turned[v] = true;
      }
    }
  }
  repeat_vertices(primitive, copied);
  for (std::size_t v = 0; v < is_turned.size(); ++v) {
    if (!is_turned[v]) {
      continue;
    }
    p.normals[v] = -p.normals[v];
    if (!p.tangents.empty()) {
      p.tangents[v].w = -p.tangents[v].w;
    }
    for (MorphTarget& target : primitive.targets) {
      if (!target.normals.empty()) {
        target.normals[v] = -target.normals[v];
      }
    }
  }
  if (!face_outwards(p, turned)) {
    primitive.maps_back = std::move(is_turned);
  }
}

}  // namespace core
