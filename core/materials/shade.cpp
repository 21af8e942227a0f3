#include "core/materials/shade.h"

#include <algorithm>
#include <cmath>

#include "core/bsdf/fresnel.h"
#include "core/geometry/triangle_math.h"
#include "core/materials/texture_places.h"
#include "core/materials/textured.h"

namespace core {
namespace {

/// Caches the last lookup of a point, because textures of a material mostly read the same texels.
struct LastLookup {
  std::uint32_t places = 0;  ///< TextureSlot::places; 0: empty
  Texture::Taps taps;
};

/// A point and its texture footprint.
struct TexturedPoint {
  const SurfacePoint& point;
  FootprintAxesOf<float> footprint;
  bool is_sharp;
  LastLookup& last;

  /// At the finest level.
  static TexturedPoint finest(const SurfacePoint& point, LastLookup& last) {
    return {point, {}, false, last};
  }
  static TexturedPoint of(const SurfacePoint& point, Vec3 wo, Footprint footprint,
                          LastLookup& last) {
    return {point, footprint_axes(point.normal_geometric, wo, footprint.width_m),
            footprint.is_sharp, last};
  }

  Vec4 read(const TextureSlot& slot) const {
    if (slot.texture == nullptr) {
      return {1, 1, 1, 1};
    }
    if (last.places != slot.places) {
      slot.texture->find_taps(lookup(slot.description), last.taps);
      last.places = slot.places;
    }
    return slot.texture->read(last.taps);
  }
  Vec4 read_finest(const TextureSlot& slot) const {
    LastLookup sharpest;
    return finest(point, sharpest).read(slot);
  }

 private:
  Texture::Lookup lookup(const TextureDescription& d) const {
    const auto set = static_cast<std::size_t>(d.uv_set);
    const UvOf<float> uv = {point.uv[set], point.uv_edge1[set], point.uv_edge2[set], point.to_edge1,
                            point.to_edge2};
    const TexturePlaceOf<float> place = texture_place(d.uv_transform, uv, footprint);
    return {.uv = place.uv,
            .across = place.across,
            .along = place.along,
            .taps_max = is_sharp ? kTextureTapsMax : 1,
            .wrap_u = d.wrap_u,
            .wrap_v = d.wrap_v,
            .nearest = d.nearest};
  }
};

/// World-space directions in which a map's u grows and its v falls.
struct MapFrame {
  Vec3 tangent;
  Vec3 bitangent;
};

/// Returns the unit direction of +u of a map in the plane of the triangle, and its handedness as
/// in PrimitiveDescription::tangents; zero if the coordinates do not change.
Vec4 flat_tangent(const SurfacePoint& p, const TextureDescription& map) {
  const auto set = static_cast<std::size_t>(map.uv_set);
  const auto& m = map.uv_transform;
  const Vec3 u0 = p.to_edge1 * p.uv_edge1[set].x + p.to_edge2 * p.uv_edge2[set].x;
  const Vec3 v0 = p.to_edge1 * p.uv_edge1[set].y + p.to_edge2 * p.uv_edge2[set].y;
  const Vec3 u = u0 * m[0] + v0 * m[1];
  const Vec3 v = u0 * m[3] + v0 * m[4];
  const float side = dot(cross(u, v), p.normal_geometric) < 0 ? -1.0F : 1.0F;
  const Vec3 along = cross(v, p.normal_geometric) * side;
  const Vec3 t =
      normalize_or(along - p.normal_shading * dot(along, p.normal_shading), Vec3{0, 0, 0});
  return {t.x, t.y, t.z, -side};
}

/// Tangents of the file apply as they are to all maps that are not `apart`; computed ones are
/// turned into the map's coordinates, as glTF 2.0 (3.9.3) defines tangents by "the texture
/// coordinates associated with the normal texture".
MapFrame frame_of(const TextureSlot& slot, const SurfacePoint& p, bool apart = false) {
  Vec3 tangent = p.tangent;
  float sign = p.tangent_sign;
  const bool is_computed = p.tangent_uv_set >= 0 && slot.texture != nullptr;
  if (is_computed ? slot.axes.along_tangent == 0 || slot.description.uv_set != p.tangent_uv_set
                  : apart) {
    const Vec4 flat = flat_tangent(p, slot.description);
    tangent = {flat.x, flat.y, flat.z};
    sign = flat.w;
  } else if (is_computed) {
    tangent = tangent * slot.axes.along_tangent;
    sign *= slot.axes.sign;
  }
  return {tangent, cross(p.normal_shading, tangent) * sign};
}

/// Returns the normal of a normal map in world space, on the front side like point.normal_shading.
/// apart: as for frame_of().
Vec3 mapped_normal(const TextureSlot& slot, float scale, const TexturedPoint& at,
                   bool apart = false) {
  const SurfacePoint& p = at.point;
  if (slot.texture == nullptr) {
    return p.normal_shading;
  }
  const MapFrame map = frame_of(slot, p, apart);
  if (length_squared(map.tangent) == 0) {
    return p.normal_shading;
  }
  return core::mapped_normal<float>(p.normal_shading, map.tangent, map.bitangent,
                                    map_normal(at.read(slot), scale));
}

/// Returns the normal of the clearcoat on the viewer's side.
Vec3 clearcoat_normal(const Material& material, const TexturedPoint& at, Vec3 wo_world) {
  // The set of a coat's map may be another one than that of the normal texture.
  const bool apart =
      material.normal.texture != nullptr &&
      material.normal.description.uv_set != material.clearcoat_normal.description.uv_set;
  const Vec3 n =
      mapped_normal(material.clearcoat_normal, material.factors.clearcoat_normal_scale, at, apart);
  return facing(dot(at.point.normal_geometric, wo_world) >= 0 ? n : -n, wo_world);
}

/// Returns the colour of an unlit material.
Rgb unlit(const Material& material, const TexturedPoint& at) {
  const Vec4 c = at.read(material.base_color);
  const Vec4 vertex = at.point.color;
  return material.factors.base_color * Rgb{c.x * vertex.x, c.y * vertex.y, c.z * vertex.z};
}

/// KHR_materials_ior and KHR_materials_specular. An ior of 0 means full reflection.
void set_dielectric(BsdfParameters& b, float ior, Rgb specular_color, float specular) {
  const float r0 = ior == 0 ? 1.0F : square((ior - 1) / (ior + 1));
  b.f0 = clamp01(specular_color * r0) * clamp01(specular);
  b.f90 = clamp01(specular);
  b.specular_color = specular_color;
  b.ior = std::max(ior, 1.0F);
}

/// Applies textures and vertex colours to the plain parameters.
void apply_textures(const Material& material, const TexturedPoint& at, BsdfParameters& b) {
  const MaterialDescription& f = material.factors;
  set_base(material, at.point.color, at, b);
  if (material.specular.texture != nullptr || material.specular_color.texture != nullptr) {
    set_dielectric(b, f.ior, f.specular_color * rgb_of(at.read(material.specular_color)),
                   f.specular * at.read(material.specular).w);
  }
  if (material.transmission.texture != nullptr) {
    b.transmission = f.ior == 0 ? 0.0F : clamp01(f.transmission * at.read(material.transmission).x);
  }
}

/// KHR_materials_anisotropy: wider along the direction.
void apply_anisotropy(const Material& material, const TexturedPoint& at, Shading& s) {
  const SurfacePoint& point = at.point;
  const MaterialDescription& f = material.factors;
  float strength = f.anisotropy;
  Vec2 direction = {std::cos(f.anisotropy_rotation_rad), std::sin(f.anisotropy_rotation_rad)};
  if (material.anisotropy.texture != nullptr) {
    const Vec4 t = at.read(material.anisotropy);
    const Vec2 d = {2 * t.x - 1, 2 * t.y - 1};
    direction = {direction.x * d.x - direction.y * d.y, direction.y * d.x + direction.x * d.y};
    strength *= t.z;
  }
  s.bsdf.alpha_x = std::max(lerp(s.bsdf.alpha_y, 1.0F, strength * strength), 1e-4F);
  const MapFrame map = frame_of(material.anisotropy, point);
  s.frame =
      frame_from_normal_tangent(s.frame.n, map.tangent * direction.x + map.bitangent * direction.y);
}

}  // namespace

// Without a turn, +u is along d / determinant = 1 / a.
MapAxes map_axes(const TextureDescription& map,
                 const std::optional<TextureDescription>& tangents) noexcept {
  const auto& m = map.uv_transform;
  if (tangents && tangents->turns_u()) {
    return {tangents->uv_transform == m ? 1.0F : 0.0F, 1};
  }
  if (map.turns_u()) {
    return {0, 1};
  }
  const float determinant = m[0] * m[4] - m[1] * m[3];
  if (determinant == 0 || !std::isfinite(determinant)) {
    return {};
  }
  return {m[0] < 0 ? -1.0F : 1.0F, determinant < 0 ? -1.0F : 1.0F};
}

Medium medium_within(const MaterialDescription& f) noexcept {
  return medium_within(f, f.attenuation_color, f.multiscatter_color);
}

Medium medium_within(const MaterialDescription& f, Rgb color, Rgb deep) noexcept {
  Medium m;
  if (!(f.attenuation_distance > 0)) {
    return m;
  }
  const auto sigma = [&f](float c) {
    return -std::log(std::max(c, 1e-6F)) / f.attenuation_distance;
  };
  const auto albedo = [&f](float c) {
    return c > 0 ? single_scattering_albedo(c, f.scatter_anisotropy) : 0.0F;
  };
  m.sigma_t = {sigma(color.r), sigma(color.g), sigma(color.b)};
  m.sigma_s = m.sigma_t * Rgb{albedo(deep.r), albedo(deep.g), albedo(deep.b)};
  m.g = f.scatter_anisotropy;
  return m;
}

BsdfParameters plain_parameters(const MaterialDescription& f, bool is_volume) noexcept {
  BsdfParameters b;
  b.base_color = clamp01(f.base_color);
  b.metallic = clamp01(f.metallic);
  set_roughness(b, f.roughness);
  set_dielectric(b, f.ior, f.specular_color, f.specular);
  b.transmission = f.ior == 0 ? 0.0F : clamp01(f.transmission);  // fully reflective
  b.thin = !is_volume;
  return b;
}

void shade(const Material& material, const SurfacePoint& point, Vec3 wo_world, Footprint footprint,
           Shading& s) noexcept {
  s.front = dot(point.normal_geometric, wo_world) >= 0;
  const float side = s.front ? 1.0F : -1.0F;
  s.normal_geometric = point.normal_geometric * side;
  s.bsdf = material.plain;
  s.bsdf.inside = !s.front;
  s.horizon = s.normal_geometric;
  s.origin = point.position;
  leave_bulge(!material.transmits, point.bulge_m, point.normal_shading, point.normal_geometric,
              side, wo_world, s.horizon, s.origin);
  LastLookup last;
  const TexturedPoint at = material.has_texture
                               ? TexturedPoint::of(point, wo_world, footprint, last)
                               : TexturedPoint::finest(point, last);
  Vec3 n = point.normal_shading;
  if (material.has_texture || point.has_color) {
    apply_textures(material, at, s.bsdf);
    n = mapped_normal(material.normal, material.factors.normal_scale, at);
  }
  s.frame = frame_from_normal(facing(n * side, wo_world));
  if (material.factors.anisotropy > 0 && length_squared(point.tangent) > 0) {
    apply_anisotropy(material, at, s);
  }
  s.has_layers = material.has_layers;
  if (material.has_layers) {
    set_layers(material, at, s.layers);
    s.layers.clearcoat_normal = s.frame.to_local(clearcoat_normal(material, at, wo_world));
  }
}

Rgb emitted(const Material& material, const SurfacePoint& point, Vec3 wo_world) noexcept {
  LastLookup last;
  const auto at = TexturedPoint::finest(point, last);
  const MaterialDescription& f = material.factors;
  if (f.unlit) {
    return unlit(material, at);
  }
  if (!material.is_emissive ||
      (!f.emits_from_both_sides() && dot(point.normal_geometric, wo_world) <= 0)) {
    return {};
  }
  Rgb out = f.emissive;
  if (material.emissive.texture != nullptr) {
    out *= rgb_of(at.read(material.emissive));
  }
  if (f.clearcoat > 0) {
    const float cosine = dot(clearcoat_normal(material, at, wo_world), wo_world);
    out *= 1 - textured_clearcoat(material, at) * lerp(0.04F, 1.0F, schlick_weight(cosine));
  }
  return out;
}

Rgb unlit_color(const Material& material, const SurfacePoint& point, Vec3 wo_world,
                Footprint footprint) noexcept {
  LastLookup last;
  return unlit(material, has_alpha_map(material)
                             ? TexturedPoint::finest(point, last)
                             : TexturedPoint::of(point, wo_world, footprint, last));
}

}  // namespace core
