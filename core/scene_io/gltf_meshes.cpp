#include "core/scene_io/gltf_meshes.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <string>
#include <utility>

#include "core/materials/material.h"
#include "core/scene_io/gltf_deform.h"
#include "core/scene_io/gltf_model.h"
#include "core/scene_io/tangent_space.h"
#include "core/scene_io/windings.h"

namespace core {
namespace {

// Turns the tangents of vertices whose normal maps are for the back of their triangles. A map seen
// from the back has all of its normals reversed: so has one whose tangent, bitangent and normal
// are.
void turn_tangents(PrimitiveDescription& p, const std::vector<bool>& maps_back) {
  for (std::size_t v = 0; v < (maps_back.empty() ? 0 : p.tangents.size()); ++v) {
    Vec4& t = p.tangents[v];
    if (maps_back[p.file_vertices.empty() ? v : p.file_vertices[v]]) {
      t = {-t.x, -t.y, -t.z, t.w};
    }
  }
}

// Normalises normals; replaces unusable ones by the mean of the adjacent triangles.
void repair_normals(PrimitiveDescription& p) {
  std::vector<bool> unusable(p.normals.size(), false);
  bool any = false;
  for (std::size_t i = 0; i < p.normals.size(); ++i) {
    unusable[i] = !(length_squared(p.normals[i]) > 1e-12F);
    any = any || unusable[i];
    p.normals[i] = unusable[i] ? Vec3{0, 0, 0} : normalize_or(p.normals[i], {0, 0, 1});
  }
  if (!any) {
    return;
  }
  for (std::size_t t = 0; t + 2 < p.indices.size(); t += 3) {
    const Vec3 a = p.positions[p.indices[t]];
    const Vec3 n = cross(p.positions[p.indices[t + 1]] - a, p.positions[p.indices[t + 2]] - a);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t v = p.indices[t + i];
      if (unusable[v]) {
        p.normals[v] += n;
      }
    }
  }
  for (std::size_t i = 0; i < p.normals.size(); ++i) {
    p.normals[i] = unusable[i] ? normalize_or(p.normals[i], {0, 0, 1}) : p.normals[i];
  }
}

/// Returns which sets of texture coordinates textures that are drawn are read by.
std::array<bool, 2> uv_sets_read(const MaterialDescription& m) {
  std::array<bool, 2> read = {};
  for (const MaterialMap& map : kMaterialMaps) {
    const TextureDescription& texture = m.*map.description;
    const bool is_read = m.unlit ? map.slot == &Material::base_color
                                 : map.slot != nullptr && (m.has_layers() || !map.is_layer);
    if (texture.image >= 0 && is_read) {
      read[static_cast<std::size_t>(texture.uv_set)] = true;
    }
  }
  return read;
}

}  // namespace

Result<int> GltfMeshes::mesh_for(const MeshUse& use) {
  const auto key = std::make_tuple(use.mesh, use.weights, use.node, use.copy);
  if (const auto it = known_.find(key); it != known_.end()) {
    return it->second;
  }
  auto made = make(use);
  if (made) {
    known_[key] = *made;
  }
  return made;
}

void GltfMeshes::note_turned(const GltfPrimitive& primitive, const std::string& mesh,
                             const std::string& where) {
  const std::string all = " of the " + std::to_string(primitive.base.indices.size() / 3) +
                          " triangles" + (mesh.empty() ? "" : " of mesh '" + mesh + "'");
  if (primitive.aligned > 0) {
    repairs_.note("turned", where,
                  std::to_string(primitive.aligned) + all +
                      " are wound the other way than their neighbours; they are turned, since the "
                      "surface of a solid has one outside");
  }
  if (primitive.turned > 0) {
    repairs_.note("turned", where,
                  "the normals of " + std::to_string(primitive.turned) + all +
                      " point to the back of their triangle; they are turned");
  }
}

Result<std::vector<GltfMeshes::Part>> GltfMeshes::read_parts(int number) {
  const tinygltf::Mesh& mesh = model_.meshes[static_cast<std::size_t>(number)];
  std::vector<Part> parts;
  for (std::size_t i = 0; i < mesh.primitives.size(); ++i) {
    const std::string where =
        "/meshes/" + std::to_string(number) + "/primitives/" + std::to_string(i);
    const int material = material_of(mesh.primitives[i]);
    const auto uv_sets = material >= 0
                             ? scene_.materials[static_cast<std::size_t>(material)].uv_sets
                             : MaterialDescription{}.uv_sets;
    auto read = read_primitive(mesh.primitives[i], source_, where, uv_sets, repairs_);
    if (!read) {
      return read.error();
    }
    if (!read->has_value()) {
      continue;
    }
    parts.push_back({static_cast<std::uint32_t>(i), where, std::move(**read)});
    PrimitiveDescription& base = parts.back().primitive.base;
    base.material = material;
    if (auto status = check_coordinates(base, where); !status) {
      return status.error();
    }
    triangles_ += base.indices.size() / 3;
    if (triangles_ > limits_.triangles_max) {
      return Error{ErrorCode::kTooLarge,
                   "more than " + std::to_string(limits_.triangles_max) + " triangles in the scene",
                   where};
    }
  }
  return parts;
}

Status GltfMeshes::check_coordinates(const PrimitiveDescription& base, const std::string& where) {
  if (base.material < 0) {
    return ok_status();
  }
  const MaterialDescription& m = scene_.materials[static_cast<std::size_t>(base.material)];
  const std::array<bool, 2> is_read = uv_sets_read(m);
  Status status = ok_status();
  for (std::size_t k = 0; k < is_read.size(); ++k) {
    const std::string name = "TEXCOORD_" + std::to_string(m.uv_sets[k]);
    if (status && is_read[k] && base.uv[k].empty() && without_uv_.insert(where + name).second) {
      status = repairs_.mended("missing", where + "/attributes",
                               "there is no " + name + ", which textures of material " +
                                   std::to_string(base.material) +
                                   (m.name.empty() ? "" : " ('" + m.name + "')") + " need",
                               "its coordinates are (0, 0), so that one texel of each counts "
                               "everywhere");
    }
  }
  return status;
}

void GltfMeshes::turn_sides(std::vector<Part>& parts, const std::string& mesh) {
  std::vector<GltfPrimitive*> of_solids;
  std::vector<PrimitiveDescription*> bases;
  for (Part& part : parts) {
    PrimitiveDescription& base = part.primitive.base;
    if (base.material >= 0 &&
        scene_.materials[static_cast<std::size_t>(base.material)].bounds_solids()) {
      of_solids.push_back(&part.primitive);
      bases.push_back(&base);
    }
  }
  const std::vector<std::size_t> aligned = align_windings(bases);
  for (std::size_t i = 0; i < aligned.size(); ++i) {
    of_solids[i]->aligned = aligned[i];
  }
  for (Part& part : parts) {
    turn_normals(part.primitive);
    note_turned(part.primitive, mesh, part.where);
  }
}

Status GltfMeshes::place(GltfPrimitive& primitive, const MeshUse& use, const std::string& where) {
  apply_morph_targets(primitive, use.weights);
  if (!use.joint_matrices.empty() && !primitive.joint_sets.empty()) {
    Status status = ok_status();
    if (const std::size_t loose = without_joints(primitive); loose > 0) {
      status = repairs_.mended("missing", where + "/attributes/WEIGHTS_0",
                               std::to_string(loose) + " vertices have only weights of 0",
                               "they follow the skin's first joint");
    }
    return status ? apply_skin(primitive, use.joint_matrices, where) : status;
  }
  if (use.baked != nullptr) {
    apply_transform(primitive.base, *use.baked);
  }
  return ok_status();
}

Result<int> GltfMeshes::make(const MeshUse& use) {
  const tinygltf::Mesh& mesh = model_.meshes[static_cast<std::size_t>(use.mesh)];
  MeshDescription description;
  description.name = mesh.name;
  const auto counts = scene_.mesh_primitives.begin();
  const std::uint32_t first_id = std::accumulate(counts, counts + use.mesh, std::uint32_t{1});
  auto parts = read_parts(use.mesh);
  if (!parts) {
    return parts.error();
  }
  turn_sides(*parts, mesh.name);
  for (auto& [number, where, primitive] : *parts) {
    primitive.base.id = first_id + number;
    if (auto status = place(primitive, use, where); !status) {
      return status.error();
    }
    finish(primitive);
    std::optional<PrimitiveDescription> backs = backs_of(primitive.base, mesh.name, where);
    description.primitives.push_back(std::move(primitive.base));
    if (backs) {
      description.primitives.push_back(*std::move(backs));
    }
  }
  if (description.primitives.empty()) {
    return -1;
  }
  scene_.meshes.push_back(std::move(description));
  return static_cast<int>(scene_.meshes.size()) - 1;
}

std::optional<PrimitiveDescription> GltfMeshes::backs_of(PrimitiveDescription& primitive,
                                                         const std::string& mesh,
                                                         const std::string& where) {
  if (primitive.material < 0) {
    return {};  // glTF's default material is opaque, and does not emit
  }
  const MaterialDescription& m = scene_.materials[static_cast<std::size_t>(primitive.material)];
  const bool is_one_sided_emitter = !is_black(m.emissive) && !m.emits_from_both_sides();
  if (!m.bounds_solids() && !is_one_sided_emitter) {
    return {};
  }
  const std::vector<bool> which = find_backs(primitive);
  if (std::find(which.begin(), which.end(), true) == which.end()) {
    return {};
  }
  std::vector<std::uint32_t> backs = take_triangles(primitive, which);
  if (m.bounds_solids()) {
    repairs_.note("left_out", where,
                  std::to_string(backs.size() / 3) + " triangles" +
                      (mesh.empty() ? "" : " of mesh '" + mesh + "'") +
                      " are there in both windings; a solid needs one, and the later is left out");
    return {};
  }
  PrimitiveDescription out = primitive;
  out.indices = std::move(backs);
  return out;
}

int GltfMeshes::material_of(const tinygltf::Primitive& primitive) const {
  const auto* extension = find_extension(primitive.extensions, "KHR_materials_variants");
  if (variant_ < 0 || extension == nullptr) {
    return primitive.material;
  }
  for (const tinygltf::Value& mapping : value_array(extension->Get("mappings"))) {
    for (const tinygltf::Value& variant : value_array(mapping.Get("variants"))) {
      if (variant.GetNumberAsInt() == variant_) {
        return value_integer(mapping, "material", -1);
      }
    }
  }
  return primitive.material;
}

void GltfMeshes::finish(GltfPrimitive& primitive) const {
  PrimitiveDescription& base = primitive.base;
  repair_normals(base);
  if (!has_tangents_ || base.material < 0) {
    return;
  }
  const MaterialDescription& material = scene_.materials[static_cast<std::size_t>(base.material)];
  const auto map = material.tangent_map();
  const bool has_normals =
      material.normal_texture.image >= 0 || material.clearcoat_normal_texture.image >= 0;
  if (primitive.turned > 0 && has_normals &&
      !base.uv[static_cast<std::size_t>(map->uv_set)].empty()) {
    base.tangents.clear();  // Whether the file's bitangents were mirrored too is not known.
  }
  if (base.tangents.empty() && map) {
    make_tangents(base, map->uv_set, map->uv_transform);
    base.tangent_uv_set = map->uv_set;
  }
  turn_tangents(base, primitive.maps_back);
}

}  // namespace core
