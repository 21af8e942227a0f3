#include "core/materials/shade.h"

#include <algorithm>
#include <cmath>

#include "core/math/numbers.h"

namespace core {
namespace {

Vec2 transformed(const TextureDescription& d, const SurfacePoint& p) {
  const Vec2 uv = p.uv[static_cast<std::size_t>(d.uv_set)];
  const auto& m = d.uv_transform;
  return {m[0] * uv.x + m[1] * uv.y + m[2], m[3] * uv.x + m[4] * uv.y + m[5]};
}

Vec4 read(const TextureSlot& slot, const SurfacePoint& p, float footprint_m) {
  if (slot.texture == nullptr) {
    return {1, 1, 1, 1};
  }
  const TextureDescription& d = slot.description;
  const float side = static_cast<float>(std::max(slot.texture->width(), slot.texture->height()));
  const auto& m = d.uv_transform;
  const float scale = std::sqrt(std::fabs(m[0] * m[4] - m[1] * m[3]));
  return slot.texture->sample({.uv = transformed(d, p),
                               .texels = footprint_m * p.texels_per_m * side * scale,
                               .wrap_u = d.wrap_u,
                               .wrap_v = d.wrap_v,
                               .nearest = d.nearest});
}

/// A normal map's normal in world space, on the front side like point.normal_shading.
Vec3 mapped_normal(const TextureSlot& slot, float scale, const SurfacePoint& p, float footprint_m) {
  if (slot.texture == nullptr || length_squared(p.tangent) == 0) {
    return p.normal_shading;
  }
  const Vec4 texel = read(slot, p, footprint_m);
  const Vec3 n = {(2 * texel.x - 1) * scale, (2 * texel.y - 1) * scale, 2 * texel.z - 1};
  const Vec3 bitangent = cross(p.normal_shading, p.tangent) * p.tangent_sign;
  return normalize_or(p.tangent * n.x + bitangent * n.y + p.normal_shading * n.z, p.normal_shading);
}

/// A shading normal the viewer can see: turned, where it faces away, just as far as needed.
Vec3 facing(Vec3 n, Vec3 wo) {
  constexpr float kLeast = 1e-3F;
  const float cos_o = dot(n, wo);
  if (cos_o >= kLeast) {
    return n;
  }
  return normalize_or(n + wo * (kLeast - cos_o), wo);
}

Rgb clamp01_rgb(Rgb c) { return {clamp01(c.r), clamp01(c.g), clamp01(c.b)}; }

/// The rarer layers, textures applied.
void fill_layers(const Material& material, const SurfacePoint& point, Vec3 wo_world, float footprint_m,
                 Shading& s) {
  const MaterialDescription& f = material.factors;
  BsdfLayers& l = s.layers;
  l.clearcoat = clamp01(f.clearcoat * read(material.clearcoat, point, footprint_m).x);
  l.clearcoat_roughness = clamp01(f.clearcoat_roughness * read(material.clearcoat_roughness, point, footprint_m).y);
  const Vec3 coat = mapped_normal(material.clearcoat_normal, f.clearcoat_normal_scale, point, footprint_m);
  l.clearcoat_normal = s.frame.to_local(facing(s.front ? coat : -coat, wo_world));
  const Vec4 sheen = read(material.sheen_color, point, footprint_m);
  l.sheen_color = clamp01_rgb(f.sheen_color * Rgb{sheen.x, sheen.y, sheen.z});
  l.sheen_roughness = clamp01(f.sheen_roughness * read(material.sheen_roughness, point, footprint_m).w);
  l.iridescence = clamp01(f.iridescence * read(material.iridescence, point, footprint_m).x);
  l.iridescence_ior = f.iridescence_ior;
  l.iridescence_thickness_nm =
      material.iridescence_thickness.texture == nullptr
          ? f.iridescence_thickness_max_nm
          : lerp(f.iridescence_thickness_min_nm, f.iridescence_thickness_max_nm,
                 read(material.iridescence_thickness, point, footprint_m).y);
  l.diffuse_transmission = clamp01(f.diffuse_transmission * read(material.diffuse_transmission, point, footprint_m).w);
  const Vec4 below = read(material.diffuse_transmission_color, point, footprint_m);
  l.diffuse_transmission_color = clamp01_rgb(f.diffuse_transmission_color * Rgb{below.x, below.y, below.z});
}

}  // namespace

namespace {

/// KHR_materials_ior and KHR_materials_specular. An ior of 0 asks for full reflection.
void set_dielectric(BsdfParameters& b, float ior, Rgb specular_color, float specular) {
  const float r0 = ior == 0 ? 1.0F : square((ior - 1) / (ior + 1));
  b.f0 = clamp01_rgb(specular_color * r0) * clamp01(specular);
  b.f90 = clamp01(specular);
  b.ior = std::max(ior, 1.0F);
}

void set_roughness(BsdfParameters& b, float roughness) {
  b.roughness = clamp01(roughness);
  b.alpha_x = b.alpha_y = std::max(b.roughness * b.roughness, 1e-4F);
}

/// Textures and vertex colours over the plain parameters.
void apply_textures(const Material& material, const SurfacePoint& point, float footprint_m, BsdfParameters& b) {
  const MaterialDescription& f = material.factors;
  // Where coverage comes from the same texture, colour is read as sharply: coarser levels would mix
  // in what stands behind alpha 0.
  const Vec4 c = read(material.base_color, point, material.has_alpha ? 0.0F : footprint_m);
  b.base_color = clamp01_rgb(f.base_color * Rgb{c.x * point.color.x, c.y * point.color.y, c.z * point.color.z});
  if (material.metallic_roughness.texture != nullptr) {
    const Vec4 mr = read(material.metallic_roughness, point, footprint_m);
    set_roughness(b, f.roughness * mr.y);
    b.metallic = clamp01(f.metallic * mr.z);
  }
  if (material.specular.texture != nullptr || material.specular_color.texture != nullptr) {
    const Vec4 sc = read(material.specular_color, point, footprint_m);
    set_dielectric(b, f.ior, f.specular_color * Rgb{sc.x, sc.y, sc.z},
                   f.specular * read(material.specular, point, footprint_m).w);
  }
  if (material.transmission.texture != nullptr) {
    b.transmission = clamp01(f.transmission * read(material.transmission, point, footprint_m).x);
  }
}

/// KHR_materials_anisotropy: wider along the direction.
void apply_anisotropy(const Material& material, const SurfacePoint& point, float footprint_m, Shading& s) {
  const MaterialDescription& f = material.factors;
  float strength = f.anisotropy;
  Vec2 direction = {std::cos(f.anisotropy_rotation_rad), std::sin(f.anisotropy_rotation_rad)};
  if (material.anisotropy.texture != nullptr) {
    const Vec4 t = read(material.anisotropy, point, footprint_m);
    const Vec2 d = {2 * t.x - 1, 2 * t.y - 1};
    direction = {direction.x * d.x - direction.y * d.y, direction.y * d.x + direction.x * d.y};
    strength *= t.z;
  }
  s.bsdf.alpha_x = std::max(lerp(s.bsdf.alpha_y, 1.0F, strength * strength), 1e-4F);
  const Vec3 bitangent = cross(point.normal_shading, point.tangent) * point.tangent_sign;
  s.frame = frame_from_normal_tangent(s.frame.n, point.tangent * direction.x + bitangent * direction.y);
}

}  // namespace

BsdfParameters plain_parameters(const MaterialDescription& f, bool is_volume) noexcept {
  BsdfParameters b;
  b.base_color = clamp01_rgb(f.base_color);
  b.metallic = clamp01(f.metallic);
  set_roughness(b, f.roughness);
  set_dielectric(b, f.ior, f.specular_color, f.specular);
  b.transmission = clamp01(f.transmission);
  b.thin = !is_volume;
  return b;
}

void shade(const SceneData& scene, const SurfacePoint& point, Vec3 wo_world, float footprint_m,
           Shading& s) noexcept {
  const Material& material = scene.materials[point.material];
  s.front = dot(point.normal_geometric, wo_world) >= 0;
  const float side = s.front ? 1.0F : -1.0F;
  s.normal_geometric = point.normal_geometric * side;
  s.bsdf = material.plain;
  s.bsdf.inside = !s.front;
  Vec3 n = point.normal_shading;
  if (material.has_texture || point.has_color) {
    apply_textures(material, point, footprint_m, s.bsdf);
    n = mapped_normal(material.normal, material.factors.normal_scale, point, footprint_m);
  }
  s.frame = frame_from_normal(facing(n * side, wo_world));
  if (material.factors.anisotropy > 0 && length_squared(point.tangent) > 0) {
    apply_anisotropy(material, point, footprint_m, s);
  }
  s.has_layers = material.has_layers;
  if (material.has_layers) {
    fill_layers(material, point, wo_world, footprint_m, s);
  }
}

Rgb emitted(const SceneData& scene, const SurfacePoint& point, Vec3 wo_world) noexcept {
  const Material& material = scene.materials[point.material];
  if (!material.is_emissive ||
      (!material.factors.double_sided && dot(point.normal_geometric, wo_world) <= 0)) {
    return {};
  }
  if (material.emissive.texture == nullptr) {
    return material.factors.emissive;
  }
  // The finest level always: light sampling and rays that hit must see the same function.
  const Vec4 c = read(material.emissive, point, 0);
  return material.factors.emissive * Rgb{c.x, c.y, c.z};
}

Rgb unlit_color(const SceneData& scene, const SurfacePoint& point, float footprint_m) noexcept {
  const Material& material = scene.materials[point.material];
  const Vec4 c = read(material.base_color, point, material.has_alpha ? 0.0F : footprint_m);
  return material.factors.base_color * Rgb{c.x * point.color.x, c.y * point.color.y, c.z * point.color.z};
}

}  // namespace core
