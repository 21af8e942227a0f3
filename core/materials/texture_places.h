/// Where on a surface its textures are read, for one point or SIMD lanes.
#pragma once

#include <array>

#include "core/geometry/triangle_math.h"
#include "core/math/frame.h"

namespace core {

/// The axes of the ellipse in which a ray cone meets a surface; world.
template <typename F>
struct FootprintAxesOf {
  Vec3Of<F> across;  ///< short axis; unit
  Vec3Of<F> along;   ///< unit
  F width_m, length_m;
};

/// normal: geometric. wo: to the viewer. width_m: across the ray.
template <typename F>
[[gnu::always_inline]] inline FootprintAxesOf<F> footprint_axes(Vec3Of<F> normal, Vec3Of<F> wo,
                                                                F width_m) noexcept {
  constexpr float kLeast =
      0.02F;  // minimum cosine: at smaller ones, footprints are longer than the surface
  // A pixel has many samples, whose positions already act as a filter: half the width adds little
  // blur to the pixel's own, and little noise at 4 samples.
  const F half_m = 0.5F * width_m;
  const F cosine = dot(normal, wo);
  const Vec3Of<F> slope = wo - normal * cosine;
  const F sine2 = dot(slope, slope);
  const MaskOf<F> is_oblique = sine2 > 1e-6F;
  const Vec3Of<F> along = slope * (1 / sqrt(sine2));
  FootprintAxesOf<F> out = {cross(normal, along), along, half_m,
                            half_m / max(abs(cosine), F(kLeast))};
  if (!all(is_oblique)) {
    const FrameOf<F> frame = frame_from_normal(normal);
    out = {select(is_oblique, out.across, frame.s), select(is_oblique, along, frame.t), half_m,
           select(is_oblique, out.length_m, half_m)};
  }
  return out;
}

/// Returns coordinates after the transform of TextureDescription.
template <typename F>
Vec2Of<F> transformed(const std::array<F, 6>& m, Vec2Of<F> uv) noexcept {
  return {m[0] * uv.x + m[1] * uv.y + m[2], m[3] * uv.x + m[4] * uv.y + m[5]};
}

/// Texture coordinates at a point, and how they change along the edges of its triangle.
template <typename F>
struct UvOf {
  Vec2Of<F> at, edge1, edge2;
  Vec3Of<F> to_edge1, to_edge2;  ///< of find_edge_ways()
};

/// Where a map is read: coordinates, and the axes of the footprint in them.
template <typename F>
struct TexturePlaceOf {
  Vec2Of<F> uv, across, along;
};

template <typename F>
[[gnu::always_inline]] inline TexturePlaceOf<F> texture_place(
    const std::array<F, 6>& m, const UvOf<F>& uv, const FootprintAxesOf<F>& footprint) noexcept {
  const auto turned = [&m](Vec2Of<F> v) -> Vec2Of<F> {
    return {m[0] * v.x + m[1] * v.y, m[3] * v.x + m[4] * v.y};
  };
  const auto moved = [&](Vec3Of<F> way, F by) {
    return turned(uv.edge1 * (dot(way, uv.to_edge1) * by) +
                  uv.edge2 * (dot(way, uv.to_edge2) * by));
  };
  return {transformed(m, uv.at), moved(footprint.across, footprint.width_m),
          moved(footprint.along, footprint.length_m)};
}

/// Returns a texel of a normal map along tangent, bitangent and normal; not normalised.
inline Vec3 map_normal(Vec4 texel, float scale) noexcept {
  return {(2 * texel.x - 1) * scale, (2 * texel.y - 1) * scale, 2 * texel.z - 1};
}
/// Returns the unit normal of map_normal() in world space. shading: without the map.
template <typename F>
[[gnu::always_inline]] inline Vec3Of<F> mapped_normal(Vec3Of<F> shading, Vec3Of<F> tangent,
                                                      Vec3Of<F> bitangent,
                                                      Vec3Of<F> of_map) noexcept {
  return normalize_or(tangent * of_map.x + bitangent * of_map.y + shading * of_map.z, shading);
}

}  // namespace core
