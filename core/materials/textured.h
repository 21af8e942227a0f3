/// Parameters and layers of a point from the factors of its material and its textures: which
/// channel of which texture multiplies which factor.
///
/// Point: has read(slot), the texel of a TextureSlot at the footprint, and read_finest(slot), at
/// the finest level; {1, 1, 1, 1} without a texture.
#pragma once

#include <algorithm>

#include "core/bsdf/bsdf_types.h"
#include "core/materials/alpha_map.h"
#include "core/materials/material.h"
#include "core/math/numbers.h"

namespace core {

/// A point where no texture is read.
struct UntexturedPoint {
  Vec4 read(const TextureSlot&) const noexcept { return {1, 1, 1, 1}; }
};

inline Rgb clamp01(Rgb c) noexcept { return {clamp01(c.r), clamp01(c.g), clamp01(c.b)}; }
inline Rgb rgb_of(Vec4 c) noexcept { return {c.x, c.y, c.z}; }

inline void set_roughness(BsdfParameters& b, float roughness) noexcept {
  b.roughness = clamp01(roughness);
  b.alpha_x = b.alpha_y = std::max(b.roughness * b.roughness, 1e-4F);
}

/// Sets colour, roughness and metal. color: of the vertices.
template <typename Point>
[[gnu::always_inline]] inline void set_base(const Material& material, Vec4 color, const Point& at,
                                            BsdfParameters& b) noexcept {
  const MaterialDescription& f = material.factors;
  // If coverage comes from the same texture, reads colour at the same level: coarser levels would
  // mix in the colour where alpha is 0.
  const Vec4 c =
      has_alpha_map(material) ? at.read_finest(material.base_color) : at.read(material.base_color);
  b.base_color = clamp01(f.base_color * Rgb{c.x * color.x, c.y * color.y, c.z * color.z});
  const Vec4 mr = at.read(material.metallic_roughness);
  set_roughness(b, f.roughness * mr.y);
  b.metallic = clamp01(f.metallic * mr.z);
}

template <typename Point>
float textured_clearcoat(const Material& material, const Point& at) noexcept {
  return clamp01(material.factors.clearcoat * at.read(material.clearcoat).x);
}

/// Sets the less common layers, except for the normal of the coat.
template <typename Point>
void set_layers(const Material& material, const Point& at, BsdfLayers& l) noexcept {
  const MaterialDescription& f = material.factors;
  static_cast<SurfaceLayers&>(l) = f;
  l.clearcoat = textured_clearcoat(material, at);
  l.clearcoat_roughness = clamp01(f.clearcoat_roughness * at.read(material.clearcoat_roughness).y);
  l.sheen_color = clamp01(f.sheen_color * rgb_of(at.read(material.sheen_color)));
  l.sheen_roughness = clamp01(f.sheen_roughness * at.read(material.sheen_roughness).w);
  l.iridescence = clamp01(f.iridescence * at.read(material.iridescence).x);
  l.iridescence_thickness_nm =
      material.iridescence_thickness.texture == nullptr
          ? f.iridescence_thickness_max_nm
          : lerp(f.iridescence_thickness_min_nm, f.iridescence_thickness_max_nm,
                 at.read(material.iridescence_thickness).y);
  l.diffuse_transmission =
      clamp01(f.diffuse_transmission * at.read(material.diffuse_transmission).w);
  l.diffuse_transmission_color =
      clamp01(f.diffuse_transmission_color * rgb_of(at.read(material.diffuse_transmission_color)));
}

}  // namespace core
