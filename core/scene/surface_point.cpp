
#include "core/geometry/triangle_math.h"
#include "core/materials/alpha_map.h"
#include "core/materials/texture_places.h"
#include "core/math/numbers.h"
#include "core/scene/drawn.h"
#include "core/scene/scene_data.h"

namespace core {
namespace {

/// The mesh and the triangle of a hit.
struct HitMesh : MeshAt {
  const PlacedInstance* instance;  ///< null: none
  const std::uint32_t* v;          ///< vertices

  HitMesh(const SceneData& scene, const RawHit& hit, float at_time)
      : MeshAt{scene.meshes[scene.placed_mesh(hit).mesh], nullptr, at_time},
        instance(scene.instance_of(hit)),
        v(&mesh.indices[3 * std::size_t{hit.primitive}]) {
    to_world = instance == nullptr ? nullptr : &instance->to_world;
  }
  Corners<Vec3> corners() const { return MeshAt::corners(v); }
  Vec3 weights(const Ray& ray) const {
    const Corners<Vec3> p = corners();
    return barycentrics(p, cross(p[1] - p[0], p[2] - p[0]), ray.origin, ray.direction);
  }
  FaceOf<float> face(const Ray& ray) const {
    const bool is_mirrored = to_world != nullptr && to_world->determinant() < 0;
    const InstanceError error = instance == nullptr ? InstanceError{} : instance->error;
    return face_at(corners(), ray.origin, ray.direction, is_mirrored ? -1.0F : 1.0F, error.spread,
                   error.place_m);
  }
  /// Returns values of the vertices.
  template <typename T>
  Corners<T> at_corners(const std::vector<T>& values) const {
    return {values[v[0]], values[v[1]], values[v[2]]};
  }
};

}  // namespace

Corners<Vec3> SceneData::corners(const RawHit& hit) const noexcept {
  return HitMesh(*this, hit, 0).corners();
}

bool SceneData::is_single_face_within(const RawHit& hit, Vec3 point) const noexcept {
  const auto placed_at = static_cast<std::size_t>(&placed_mesh(hit) - placed.data());
  return !near_planes.empty() &&
         near_planes[placed_at].are_beyond(edge_margin_m, hit.primitive, point);
}

bool SceneData::is_single_face(const RawHit& hit, Vec3 point) const noexcept {
  if (!is_single_face_within(hit, point)) {
    return false;
  }
  const Corners<Vec3> p = corners(hit);
  return is_within(p, cross(p[1] - p[0], p[2] - p[0]), point, edge_margin_m);
}

SurfacePoint SceneData::surface_point(const RawHit& hit, const Ray& ray) const noexcept {
  const PlacedMesh& here = placed_mesh(hit);
  const HitMesh at(*this, hit, ray.time);
  const MeshData& mesh = at.mesh;
  const FaceOf<float> face = at.face(ray);

  SurfacePoint s;
  s.position = face.position;
  s.error_m = face.error_m;
  s.normal_geometric = face.geometric;
  s.normal_shading = s.normal_geometric;
  if (!mesh.normals.empty()) {
    Corners<Vec3> corner;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 n = at.normal(at.v[k]);
      corner[k] = at.is_moved() ? normalize_or(n, s.normal_geometric) : n;
    }
    s.normal_shading = normalize_or(blend(corner, face.b), s.normal_geometric);
    const bool front = dot(s.normal_geometric, ray.direction) <= 0;
    if (mesh.is_round(hit.primitive, front)) {
      s.bulge_m = bulge(face.p, corner, face.b, front ? 1.0F : -1.0F);
    }
  }
  const Material& material = materials[mesh.material];
  if (material.has_texture || material.is_emissive) {
    for (std::size_t k = 0; k < 2; ++k) {
      if (!mesh.uv[k].empty()) {
        const Corners<Vec2> uv = at.at_corners(mesh.uv[k]);
        s.uv[k] = blend(uv, face.b);
        s.uv_edge1[k] = uv[1] - uv[0];
        s.uv_edge2[k] = uv[2] - uv[0];
      }
    }
    if (material.has_texture) {
      find_edge_ways(face, s.to_edge1, s.to_edge2);
    }
  }
  if (!mesh.colors.empty()) {
    s.color = blend(at.at_corners(mesh.colors), face.b);
    s.has_color = true;
  }
  if (!mesh.tangents.empty()) {
    const Vec4 t = blend(at.at_corners(mesh.tangents), face.b);
    s.tangent = normalize_or(at.vector({t.x, t.y, t.z}, at.v), {0, 0, 0});
    s.tangent_uv_set = mesh.tangent_uv_set;
    s.tangent_sign = t.w < 0 ? -face.mirror : face.mirror;
  }
  s.material = mesh.material;
  s.placed = static_cast<std::uint32_t>(&here - placed.data());
  s.light = here.first_light == kNoLight ? kNoLight : here.first_light + hit.primitive;
  return s;
}

SceneData::CornerWeights SceneData::corner_weights(const RawHit& hit,
                                                   const Ray& ray) const noexcept {
  const HitMesh at(*this, hit, ray.time);
  return {{at.v[0], at.v[1], at.v[2]}, at.weights(ray)};
}

Vec2 SceneData::uv(const RawHit& hit, const Ray& ray) const noexcept {
  const HitMesh at(*this, hit, ray.time);
  const auto& uv = at.mesh.uv[0];
  return uv.empty() ? Vec2{} : blend(at.at_corners(uv), at.weights(ray));
}

float SceneData::coverage(const RawHit& hit, const Ray& ray) const noexcept {
  const HitMesh at(*this, hit, ray.time);
  const MeshData& mesh = at.mesh;
  const Material& material = materials[mesh.material];
  if (!material.has_alpha) {
    return 1;
  }
  float alpha = material.factors.base_alpha;
  const TextureSlot& slot = material.base_color;
  const bool has_texture = has_alpha_map(material);
  if (has_texture || !mesh.colors.empty()) {
    const Vec3 b = at.weights(ray);
    if (!mesh.colors.empty()) {
      alpha *= blend(at.at_corners(mesh.colors), b).w;
    }
    if (has_texture) {
      const TextureDescription& d = slot.description;
      const auto& uv = mesh.uv[static_cast<std::size_t>(d.uv_set)];
      const Vec2 p = uv.empty() ? Vec2{} : blend(at.at_corners(uv), b);
      alpha *= slot.texture
                   ->sample({.uv = transformed(d.uv_transform, p),
                             .wrap_u = d.wrap_u,
                             .wrap_v = d.wrap_v,
                             .nearest = d.nearest})
                   .w;
    }
  }
  if (material.factors.alpha_mode == AlphaMode::kMask) {
    return alpha >= material.factors.alpha_cutoff * kAlphaRounding ? 1.0F : 0.0F;
  }
  return clamp01(alpha);
}

}  // namespace core
