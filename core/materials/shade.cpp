#include "core/materials/shade.h"

#include <algorithm>
#include <cmath>

#include "core/bsdf/fresnel.h"
#include "core/geometry/triangle_math.h"
#include "core/materials/alpha_map.h"
#include "core/math/numbers.h"

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
  Vec3 across_m;  ///< short axis of the elliptical footprint on the surface, world
  Vec3 along_m;
  bool is_sharp;
  LastLookup& last;
};

TexturedPoint with_footprint(const SurfacePoint& point, Vec3 wo, Footprint footprint,
                             LastLookup& last) {
  // A pixel has many samples, whose positions already act as a filter: half the width adds little
  // blur to the pixel's own, and little noise at 4 samples.
  footprint.width_m *= 0.5F;
  constexpr float kLeast =
      0.02F;  // minimum cosine: at smaller ones, footprints are longer than the surface
  const Vec3 n = point.normal_geometric;
  const float cosine = dot(n, wo);
  const Vec3 slope = wo - n * cosine;
  const float sine2 = length_squared(slope);
  if (!(sine2 > 1e-6F)) {
    const Frame frame = frame_from_normal(n);
    return {point, frame.s * footprint.width_m, frame.t * footprint.width_m, footprint.is_sharp,
            last};
  }
  const Vec3 along = slope * (1 / std::sqrt(sine2));
  return {point, cross(n, along) * footprint.width_m,
          along * (footprint.width_m / std::max(std::fabs(cosine), kLeast)), footprint.is_sharp,
          last};
}

Texture::Lookup lookup(const TextureDescription& d, const TexturedPoint& at) {
  const auto set = static_cast<std::size_t>(d.uv_set);
  const auto& m = d.uv_transform;
  const auto turned = [&m](Vec2 v) {
    return Vec2{m[0] * v.x + m[1] * v.y, m[3] * v.x + m[4] * v.y};
  };
  const auto moved = [&](Vec3 way) {
    const float a = dot(way, at.point.to_edge1);
    const float b = dot(way, at.point.to_edge2);
    return turned(at.point.uv_edge1[set] * a + at.point.uv_edge2[set] * b);
  };
  const Vec2 base = turned(at.point.uv[set]);
  return {.uv = {base.x + m[2], base.y + m[5]},
          .across = moved(at.across_m),
          .along = moved(at.along_m),
          .taps_max = at.is_sharp ? kTextureTapsMax : 1,
          .wrap_u = d.wrap_u,
          .wrap_v = d.wrap_v,
          .nearest = d.nearest};
}

Vec4 read(const TextureSlot& slot, const TexturedPoint& at) {
  if (slot.texture == nullptr) {
    return {1, 1, 1, 1};
  }
  if (at.last.places != slot.places) {
    slot.texture->find_taps(lookup(slot.description, at), at.last.taps);
    at.last.places = slot.places;
  }
  return slot.texture->read(at.last.taps);
}

/// Returns the same point at the finest level.
TexturedPoint finest(const SurfacePoint& point, LastLookup& last) {
  return {point, {}, {}, false, last};
}

/// World-space directions in which a map's u grows and its v falls.
struct MapFrame {
  Vec3 tangent;
  Vec3 bitangent;
};

/// Returns the unit direction of +u of a set in the plane of the triangle, and its handedness as
/// in PrimitiveDescription::tangents; zero if the coordinates do not change.
Vec4 flat_tangent(const SurfacePoint& p, std::size_t set) {
  const Vec3 u = p.to_edge1 * p.uv_edge1[set].x + p.to_edge2 * p.uv_edge2[set].x;
  const Vec3 v = p.to_edge1 * p.uv_edge1[set].y + p.to_edge2 * p.uv_edge2[set].y;
  const float side = dot(cross(u, v), p.normal_geometric) < 0 ? -1.0F : 1.0F;
  const Vec3 along = cross(v, p.normal_geometric) * side;
  const Vec3 t =
      normalize_or(along - p.normal_shading * dot(along, p.normal_shading), Vec3{0, 0, 0});
  return {t.x, t.y, t.z, -side};
}

/// Tangents of the file apply to all maps as they are; computed ones are turned into the map's
/// coordinates, as glTF 2.0 (3.9.3) defines tangents by "the texture coordinates associated with
/// the normal texture".
MapFrame frame_of(const TextureSlot& slot, const SurfacePoint& p) {
  Vec3 tangent = p.tangent;
  float sign = p.tangent_sign;
  if (p.tangent_uv_set >= 0 && slot.texture != nullptr) {
    if (slot.description.uv_set != p.tangent_uv_set) {
      const Vec4 flat = flat_tangent(p, static_cast<std::size_t>(slot.description.uv_set));
      tangent = {flat.x, flat.y, flat.z};
      sign = flat.w;
    }
    const Vec3 bitangent = cross(p.normal_shading, tangent) * sign;
    tangent = tangent * slot.axes.along_tangent + bitangent * slot.axes.along_bitangent;
    sign *= slot.axes.sign;
  }
  return {tangent, cross(p.normal_shading, tangent) * sign};
}

/// Returns the normal of a normal map in world space, on the front side like point.normal_shading.
Vec3 mapped_normal(const TextureSlot& slot, float scale, const TexturedPoint& at) {
  const SurfacePoint& p = at.point;
  if (slot.texture == nullptr || length_squared(p.tangent) == 0) {
    return p.normal_shading;
  }
  const Vec4 texel = read(slot, at);
  const Vec3 n = {(2 * texel.x - 1) * scale, (2 * texel.y - 1) * scale, 2 * texel.z - 1};
  const MapFrame map = frame_of(slot, p);
  return normalize_or(map.tangent * n.x + map.bitangent * n.y + p.normal_shading * n.z,
                      p.normal_shading);
}

Rgb clamp01_rgb(Rgb c) { return {clamp01(c.r), clamp01(c.g), clamp01(c.b)}; }

float clearcoat(const Material& material, const TexturedPoint& at) {
  return clamp01(material.factors.clearcoat * read(material.clearcoat, at).x);
}

/// Returns the normal of the clearcoat on the viewer's side.
Vec3 clearcoat_normal(const Material& material, const TexturedPoint& at, Vec3 wo_world) {
  const Vec3 n =
      mapped_normal(material.clearcoat_normal, material.factors.clearcoat_normal_scale, at);
  return facing(dot(at.point.normal_geometric, wo_world) >= 0 ? n : -n, wo_world);
}

/// Returns the colour of an unlit material.
Rgb unlit(const Material& material, const TexturedPoint& at) {
  const Vec4 c = read(material.base_color, at);
  const Vec4 vertex = at.point.color;
  return material.factors.base_color * Rgb{c.x * vertex.x, c.y * vertex.y, c.z * vertex.z};
}

/// Fills the less common layers, with textures.
void fill_layers(const Material& material, const TexturedPoint& at, Vec3 wo_world, Shading& s) {
  const MaterialDescription& f = material.factors;
  BsdfLayers& l = s.layers;
  static_cast<SurfaceLayers&>(l) = f;
  l.clearcoat = clearcoat(material, at);
  l.clearcoat_roughness = clamp01(f.clearcoat_roughness * read(material.clearcoat_roughness, at).y);
  l.clearcoat_normal = s.frame.to_local(clearcoat_normal(material, at, wo_world));
  const Vec4 sheen = read(material.sheen_color, at);
  l.sheen_color = clamp01_rgb(f.sheen_color * Rgb{sheen.x, sheen.y, sheen.z});
  l.sheen_roughness = clamp01(f.sheen_roughness * read(material.sheen_roughness, at).w);
  l.iridescence = clamp01(f.iridescence * read(material.iridescence, at).x);
  l.iridescence_thickness_nm =
      material.iridescence_thickness.texture == nullptr
          ? f.iridescence_thickness_max_nm
          : lerp(f.iridescence_thickness_min_nm, f.iridescence_thickness_max_nm,
                 read(material.iridescence_thickness, at).y);
  l.diffuse_transmission =
      clamp01(f.diffuse_transmission * read(material.diffuse_transmission, at).w);
  const Vec4 below = read(material.diffuse_transmission_color, at);
  l.diffuse_transmission_color =
      clamp01_rgb(f.diffuse_transmission_color * Rgb{below.x, below.y, below.z});
}

/// KHR_materials_ior and KHR_materials_specular. An ior of 0 means full reflection.
void set_dielectric(BsdfParameters& b, float ior, Rgb specular_color, float specular) {
  const float r0 = ior == 0 ? 1.0F : square((ior - 1) / (ior + 1));
  b.f0 = clamp01_rgb(specular_color * r0) * clamp01(specular);
  b.f90 = clamp01(specular);
  b.specular_color = specular_color;
  b.ior = std::max(ior, 1.0F);
}

void set_roughness(BsdfParameters& b, float roughness) {
  b.roughness = clamp01(roughness);
  b.alpha_x = b.alpha_y = std::max(b.roughness * b.roughness, 1e-4F);
}

/// Applies textures and vertex colours to the plain parameters.
void apply_textures(const Material& material, const TexturedPoint& at, BsdfParameters& b) {
  const SurfacePoint& point = at.point;
  const MaterialDescription& f = material.factors;
  // If coverage comes from the same texture, reads colour at the same level: coarser levels would
  // mix in the colour where alpha is 0.
  LastLookup sharpest;
  const Vec4 c = read(material.base_color, has_alpha_map(material) ? finest(point, sharpest) : at);
  b.base_color = clamp01_rgb(f.base_color *
                             Rgb{c.x * point.color.x, c.y * point.color.y, c.z * point.color.z});
  if (material.metallic_roughness.texture != nullptr) {
    const Vec4 mr = read(material.metallic_roughness, at);
    set_roughness(b, f.roughness * mr.y);
    b.metallic = clamp01(f.metallic * mr.z);
  }
  if (material.specular.texture != nullptr || material.specular_color.texture != nullptr) {
    const Vec4 sc = read(material.specular_color, at);
    set_dielectric(b, f.ior, f.specular_color * Rgb{sc.x, sc.y, sc.z},
                   f.specular * read(material.specular, at).w);
  }
  if (material.transmission.texture != nullptr) {
    b.transmission =
        f.ior == 0 ? 0.0F : clamp01(f.transmission * read(material.transmission, at).x);
  }
}

/// KHR_materials_anisotropy: wider along the direction.
void apply_anisotropy(const Material& material, const TexturedPoint& at, Shading& s) {
  const SurfacePoint& point = at.point;
  const MaterialDescription& f = material.factors;
  float strength = f.anisotropy;
  Vec2 direction = {std::cos(f.anisotropy_rotation_rad), std::sin(f.anisotropy_rotation_rad)};
  if (material.anisotropy.texture != nullptr) {
    const Vec4 t = read(material.anisotropy, at);
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

// Coordinates q = A p grow along u where p grows along the first column of A^-1, (d, -c) / det for
// A = (a b; c d); p's v grows against the bitangent.
MapAxes map_axes(const std::array<float, 6>& uv_transform) noexcept {
  const float a = uv_transform[0];
  const float b = uv_transform[1];
  const float c = uv_transform[3];
  const float d = uv_transform[4];
  const float determinant = a * d - b * c;
  const float size = std::hypot(c, d);
  if (determinant == 0 || !std::isfinite(determinant) || !std::isfinite(size)) {
    return {};
  }
  const float sign = determinant < 0 ? -1.0F : 1.0F;
  return {sign * d / size, sign * c / size, sign};
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
  b.base_color = clamp01_rgb(f.base_color);
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
  if (point.bulge_m > 0 && !material.transmits &&
      dot(point.normal_shading, point.normal_geometric) > 0) {
    s.horizon = facing(point.normal_shading * side, wo_world);
    s.origin = point.position + point.normal_shading * (side * point.bulge_m);
  }
  LastLookup last;
  const TexturedPoint at =
      material.has_texture ? with_footprint(point, wo_world, footprint, last) : finest(point, last);
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
    fill_layers(material, at, wo_world, s);
  }
}

Rgb emitted(const Material& material, const SurfacePoint& point, Vec3 wo_world) noexcept {
  LastLookup last;
  const TexturedPoint at = finest(point, last);
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
    const Vec4 c = read(material.emissive, at);
    out *= Rgb{c.x, c.y, c.z};
  }
  if (f.clearcoat > 0) {
    const float cosine = dot(clearcoat_normal(material, at, wo_world), wo_world);
    out *= 1 - clearcoat(material, at) * lerp(0.04F, 1.0F, schlick_weight(cosine));
  }
  return out;
}

Rgb unlit_color(const Material& material, const SurfacePoint& point, Vec3 wo_world,
                Footprint footprint) noexcept {
  LastLookup last;
  return unlit(material, has_alpha_map(material)
                             ? finest(point, last)
                             : with_footprint(point, wo_world, footprint, last));
}

}  // namespace core
