
#include "core/geometry/triangle_math.h"
#include "core/materials/alpha_map.h"
#include "core/math/numbers.h"
#include "core/scene/drawn.h"
#include "core/scene/scene_data.h"

namespace core {
namespace {

struct Triangle {
  Corners<Vec3> p;
  std::uint32_t v[3];

  Vec3 cross_product() const { return cross(p[1] - p[0], p[2] - p[0]); }
};

Triangle triangle_of(const MeshData& mesh, const Transform* to_world, std::uint32_t triangle,
                     float time) {
  Triangle c;
  for (std::size_t k = 0; k < 3; ++k) {
    c.v[k] = mesh.indices[3 * std::size_t{triangle} + k];
    const Vec3 p = mesh.position(c.v[k], time);
    c.p[k] = to_world == nullptr ? p : to_world->point(p);
  }
  return c;
}

template <typename T>
T blend(const std::vector<T>& values, const Triangle& c, Vec3 b) {
  return values[c.v[0]] * b.x + values[c.v[1]] * b.y + values[c.v[2]] * b.z;
}

Vec4 blend(const std::vector<Vec4>& values, const Triangle& c, Vec3 b) {
  const Vec4 v0 = values[c.v[0]];
  const Vec4 v1 = values[c.v[1]];
  const Vec4 v2 = values[c.v[2]];
  return {v0.x * b.x + v1.x * b.y + v2.x * b.z, v0.y * b.x + v1.y * b.y + v2.y * b.z,
          v0.z * b.x + v1.z * b.y + v2.z * b.z, v0.w * b.x + v1.w * b.y + v2.w * b.z};
}

/// A hit on its triangle.
struct FaceHit {
  const Transform* to_world;  ///< null: world
  Triangle triangle;
  Vec3 n;  ///< cross product of the edges
  Vec3 b;  ///< barycentric coordinates
  float twice_area;
  bool is_mirrored;
  Vec3 position;
  Vec3 normal_geometric;
  float error_m;

  FaceHit(const SceneData& scene, const RawHit& hit, const Ray& ray) {
    const PlacedInstance* instance =
        hit.instance == kNoInstance ? nullptr : &scene.instances[hit.instance];
    to_world = instance == nullptr ? nullptr : &instance->to_world;
    triangle =
        triangle_of(scene.meshes[scene.placed_mesh(hit).mesh], to_world, hit.primitive, ray.time);
    const Corners<Vec3>& p = triangle.p;
    n = triangle.cross_product();
    b = barycentrics(p, n, ray.origin, ray.direction);
    twice_area = length(n);
    is_mirrored = to_world != nullptr && to_world->determinant() < 0;
    position = core::blend(p, b);
    error_m = plane_error_m(position, p[1] - p[0], p[2] - p[0], twice_area,
                            instance == nullptr ? InstanceError{} : instance->error);
    normal_geometric = twice_area > 0 ? n * ((is_mirrored ? -1.0F : 1.0F) / twice_area)
                                      : -normalize(ray.direction);
  }
};

}  // namespace

Corners<Vec3> SceneData::corners(const RawHit& hit) const noexcept {
  return triangle_of(meshes[placed_mesh(hit).mesh],
                     hit.instance == kNoInstance ? nullptr : &instances[hit.instance].to_world,
                     hit.primitive, 0)
      .p;
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
  const MeshData& mesh = meshes[here.mesh];
  const FaceHit at(*this, hit, ray);
  const Transform* to_world = at.to_world;
  const Triangle& c = at.triangle;
  const Vec3 n = at.n;
  const Vec3 b = at.b;
  const float twice_area = at.twice_area;
  const bool mirrored = at.is_mirrored;

  SurfacePoint s;
  s.position = at.position;
  s.error_m = at.error_m;
  s.normal_geometric = at.normal_geometric;
  s.normal_shading = s.normal_geometric;
  if (!mesh.normals.empty()) {
    Corners<Vec3> corner;
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3 m = mesh.normals[c.v[k]];
      if (!mesh.later.empty()) {
        m = normalize_or(mesh.at_time(&MovedVertices::normals, m, c.v[k], ray.time),
                         s.normal_geometric);
      }
      corner[k] = to_world == nullptr ? m : normalize_or(to_world->normal(m), s.normal_geometric);
    }
    s.normal_shading = normalize_or(blend(corner, b), s.normal_geometric);
    const bool front = dot(s.normal_geometric, ray.direction) <= 0;
    if (mesh.is_round(hit.primitive, front)) {
      s.bulge_m = bulge(c.p, corner, b, front ? 1.0F : -1.0F);
    }
  }
  const Material& material = materials[mesh.material];
  if (material.has_texture || material.is_emissive) {
    for (std::size_t k = 0; k < 2; ++k) {
      if (!mesh.uv[k].empty()) {
        const auto& uv = mesh.uv[k];
        s.uv[k] = blend(uv, c, b);
        s.uv_edge1[k] = uv[c.v[1]] - uv[c.v[0]];
        s.uv_edge2[k] = uv[c.v[2]] - uv[c.v[0]];
      }
    }
    if (material.has_texture && twice_area > 0) {
      const float scale = 1 / (twice_area * twice_area);
      s.to_edge1 = cross(c.p[2] - c.p[0], n) * scale;
      s.to_edge2 = cross(n, c.p[1] - c.p[0]) * scale;
    }
  }
  if (!mesh.colors.empty()) {
    s.color = blend(mesh.colors, c, b);
    s.has_color = true;
  }
  if (!mesh.tangents.empty()) {
    const Vec4 t = blend(mesh.tangents, c, b);
    Vec3 moved = to_world == nullptr ? Vec3{t.x, t.y, t.z} : to_world->vector({t.x, t.y, t.z});
    if (!mesh.later.empty()) {
      moved = carried(moved, triangle_of(mesh, nullptr, hit.primitive, 0).p, c.p);
    }
    s.tangent = normalize_or(moved, {0, 0, 0});
    s.tangent_uv_set = mesh.tangent_uv_set;
    s.tangent_sign = (t.w < 0) != mirrored ? -1.0F : 1.0F;
  }
  s.material = mesh.material;
  s.placed = static_cast<std::uint32_t>(&here - placed.data());
  s.light = here.first_light == kNoLight ? kNoLight : here.first_light + hit.primitive;
  return s;
}

SceneData::CornerWeights SceneData::corner_weights(const RawHit& hit,
                                                   const Ray& ray) const noexcept {
  const Transform* to_world =
      hit.instance == kNoInstance ? nullptr : &instances[hit.instance].to_world;
  const Triangle c = triangle_of(meshes[placed_mesh(hit).mesh], to_world, hit.primitive, ray.time);
  return {{c.v[0], c.v[1], c.v[2]},
          barycentrics(c.p, c.cross_product(), ray.origin, ray.direction)};
}

Vec2 SceneData::uv(const RawHit& hit, const Ray& ray) const noexcept {
  const MeshData& mesh = meshes[placed_mesh(hit).mesh];
  if (mesh.uv[0].empty()) {
    return {};
  }
  const auto [v, b] = corner_weights(hit, ray);
  return mesh.uv[0][v[0]] * b.x + mesh.uv[0][v[1]] * b.y + mesh.uv[0][v[2]] * b.z;
}

float SceneData::coverage(const RawHit& hit, const Ray& ray) const noexcept {
  const PlacedMesh& here = placed_mesh(hit);
  const MeshData& mesh = meshes[here.mesh];
  const Material& material = materials[mesh.material];
  if (!material.has_alpha) {
    return 1;
  }
  float alpha = material.factors.base_alpha;
  const TextureSlot& slot = material.base_color;
  const bool has_texture = has_alpha_map(material);
  if (has_texture || !mesh.colors.empty()) {
    const Transform* to_world =
        hit.instance == kNoInstance ? nullptr : &instances[hit.instance].to_world;
    const Triangle c = triangle_of(mesh, to_world, hit.primitive, ray.time);
    const Vec3 b = barycentrics(c.p, c.cross_product(), ray.origin, ray.direction);
    if (!mesh.colors.empty()) {
      alpha *= blend(mesh.colors, c, b).w;
    }
    if (has_texture) {
      const TextureDescription& d = slot.description;
      const auto& uv = mesh.uv[static_cast<std::size_t>(d.uv_set)];
      const Vec2 p = uv.empty() ? Vec2{} : blend(uv, c, b);
      const auto& m = d.uv_transform;
      alpha *= slot.texture
                   ->sample({.uv = {m[0] * p.x + m[1] * p.y + m[2], m[3] * p.x + m[4] * p.y + m[5]},
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
