/// Textures of colour, metallic-roughness, normals, clearcoat and sheen in lanes, equivalent to the
/// scalar code in core/materials/shade.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "core/materials/alpha_map.h"
#include "core/math/frame.h"
#include "core/wave/lane_rows.h"
#include "core/wave/lane_surfaces.h"
#include "core/wave/lane_textures.h"
#include "core/wave/lane_triangles.h"

namespace core {

/// Returns the first texture of the material that lanes read; null: there is none.
inline const TextureSlot* first_mapped(const Material& m) {
  for (const MaterialMap& map : kMaterialMaps) {
    if (map.in_lanes == MapInLanes::kRead && (m.*map.slot).texture != nullptr) {
      return &(m.*map.slot);
    }
  }
  return nullptr;
}
/// Returns whether lanes can read the material's textures, all at the same coordinates and with the
/// same transform. Does not look at its factors.
inline bool is_mapped(const Material& m) {
  const TextureSlot* first = first_mapped(m);
  if (first == nullptr || first->description.nearest) {
    return false;
  }
  return std::ranges::all_of(kMaterialMaps, [&](const MaterialMap& map) {
    if (map.slot == nullptr || !map.is_shaded || (m.*map.slot).texture == nullptr) {
      return true;
    }
    return map.in_lanes == MapInLanes::kByFactor ||
           (map.in_lanes == MapInLanes::kRead && (m.*map.slot).places == first->places);
  });
}

/// The textures of a mapped material; null where absent.
struct alignas(64) LaneMaps {
  /// Lookup parameters: transform of uv without its shift; shift, normal scale, metallic; base
  /// colour, roughness; as bits, width, height, levels, and wrap modes.
  float at[16] = {};
  const Texture* base_color = nullptr;
  const Texture* metallic_roughness = nullptr;
  const Texture* normal = nullptr;
  const Material* layered = nullptr;  ///< for the textures of clearcoat and sheen
  /// Base colour at the finest level, as coverage: null where it is filtered.
  const TextureDescription* finest_color = nullptr;

  /// Without textures if the material has none that lanes read.
  static LaneMaps of(const Material& m) {
    const TextureSlot* first = first_mapped(m);
    return first != nullptr ? LaneMaps(m, *first) : LaneMaps();
  }
  /// Maps without textures: one texel.
  LaneMaps() {
    for (const std::size_t size : {12U, 13U, 14U}) {
      at[size] = std::bit_cast<float>(1);
    }
  }
  LaneMaps(const Material& m, const TextureSlot& first)
      : base_color(m.base_color.texture),
        metallic_roughness(m.metallic_roughness.texture),
        normal(m.normal.texture),
        layered(m.has_layers ? &m : nullptr),
        finest_color(has_alpha_map(m) ? &m.base_color.description : nullptr) {
    const TextureDescription& d = first.description;
    const MaterialDescription& f = m.factors;
    const float values[12] = {d.uv_transform[0], d.uv_transform[1], d.uv_transform[3],
                              d.uv_transform[4], d.uv_transform[2], d.uv_transform[5],
                              f.normal_scale,    f.metallic,        f.base_color.r,
                              f.base_color.g,    f.base_color.b,    f.roughness};
    std::copy_n(values, 12, at);
    const int wraps = static_cast<int>(d.wrap_u) | static_cast<int>(d.wrap_v) << 8;
    const int sizes[4] = {first.texture->width(), first.texture->height(),
                          first.texture->level_count(), wraps};
    std::memcpy(at + 12, sizes, sizeof sizes);
  }
};

/// Addresses of the lanes' maps and lookup parameters.
template <std::size_t N>
struct MapRows {
  const LaneMaps* maps[N];
  const float* row[N];
  const float* tangents[3][N];
  Vec4 turned[3][N];
  alignas(32) float u[3][N];
  alignas(32) float v[3][N];

  MapRows() {
    static const LaneMaps kNone;
    for (std::size_t k = 0; k < N; ++k) {
      set(k, kNone);
      for (std::size_t c = 0; c < 3; ++c) {
        tangents[c][k] = kNothing;
        u[c][k] = v[c][k] = 0;
      }
    }
  }
  void set(std::size_t k, const LaneMaps& to) {
    maps[k] = &to;
    row[k] = to.at;
  }
};

/// Multiplies the layers' factors by their textures in the lanes of `on`. coat_texels: of the
/// normal map, replaced where there is one.
template <std::size_t N>
[[gnu::noinline]] void read_layers(const MapRows<N>& rows, const Texture::Taps (&taps)[N],
                                   unsigned on, LayerLanes<N>& layers, Vec3s<N>& coat_texels) {
  for (; on != 0; on &= on - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(on));
    const Material* m = rows.maps[k]->layered;
    if (m == nullptr) {
      continue;
    }
    const auto read = [&](const TextureSlot& slot) {
      return slot.texture == nullptr ? Vec4{1, 1, 1, 1} : slot.texture->read(taps[k]);
    };
    layers.clearcoat.v[k] *= read(m->clearcoat).x;
    layers.clearcoat_roughness.v[k] *= read(m->clearcoat_roughness).y;
    const Vec4 sheen = read(m->sheen_color);
    layers.sheen_color.set(k, layers.sheen_color.lane(k) * Vec3{sheen.x, sheen.y, sheen.z});
    layers.sheen_roughness.v[k] *= read(m->sheen_roughness).w;
    if (m->clearcoat_normal.texture != nullptr) {
      const Vec4 t = read(m->clearcoat_normal);
      const float scale = m->factors.clearcoat_normal_scale;
      coat_texels.set(k, {(2 * t.x - 1) * scale, (2 * t.y - 1) * scale, 2 * t.z - 1});
    }
  }
}

/// A pair of coordinates after the maps' transform; c: the columns of MapRows::row.
template <std::size_t N>
Vec2s<N> turned(const Floats<N> (&c)[4][4], Vec2s<N> way) {
  return {c[0][0] * way.x + c[0][1] * way.y, c[0][2] * way.x + c[0][3] * way.y};
}

/// Where and how wide the maps are read. As in seen() and lookup() of core/materials/shade.cpp.
template <std::size_t N>
[[gnu::always_inline]] inline TextureLookups<N> map_lookups(const SegmentLanes<N>& segments,
                                                            const TriangleLanes<N>& at,
                                                            const MapRows<N>& rows,
                                                            const Floats<N> (&c)[4][4],
                                                            Floats<N> cone_width_m) {
  const Floats<N> zero(0);
  const Floats<N> one(1);
  Vec2s<N> uv[3];
  for (std::size_t k = 0; k < 3; ++k) {
    uv[k] = {load<N>(rows.u[k]), load<N>(rows.v[k])};
  }
  const Vec2s<N> base = turned(c, {uv[0].x * at.b.x + uv[1].x * at.b.y + uv[2].x * at.b.z,
                                   uv[0].y * at.b.x + uv[1].y * at.b.y + uv[2].y * at.b.z});
  const Vec3s<N> wo = -segments.direction;
  const Floats<N> width_m = Floats<N>(0.5F) * cone_width_m;
  const Floats<N> cosine = dot(at.geometric, wo);
  const Vec3s<N> slope = wo - at.geometric * cosine;
  const Floats<N> sine2 = dot(slope, slope);
  const Mask<N> is_steep = sine2 > Floats<N>(1e-6F);
  const FrameOf<Floats<N>> frame = frame_from_normal(at.geometric);
  const Vec3s<N> along = select(is_steep, slope * (one / sqrt(sine2)), frame.t);
  const Vec3s<N> across = select(is_steep, cross(at.geometric, along), frame.s);
  const Floats<N> length_m =
      select(is_steep, width_m / max(abs(cosine), Floats<N>(0.02F)), width_m);
  const Floats<N> scale = select(at.twice_area > zero, one / (at.twice_area * at.twice_area), zero);
  const Vec3s<N> to_edge1 = cross(at.p[2] - at.p[0], at.n) * scale;
  const Vec3s<N> to_edge2 = cross(at.n, at.p[1] - at.p[0]) * scale;
  const auto moved = [&](Vec3s<N> way, Floats<N> by) {
    const Floats<N> a = dot(way, to_edge1) * by;
    const Floats<N> b = dot(way, to_edge2) * by;
    return turned(c, {(uv[1].x - uv[0].x) * a + (uv[2].x - uv[0].x) * b,
                      (uv[1].y - uv[0].y) * a + (uv[2].y - uv[0].y) * b});
  };
  TextureLookups<N> lookups;
  lookups.uv = {base.x + c[1][0], base.y + c[1][1]};
  lookups.across = moved(across, width_m);
  lookups.along = moved(along, length_m);
  lookups.is_sharp = ~(segments.is_sharp == Ints<N>(0));
  lookups.width = bits_of(c[3][0]);
  lookups.height = bits_of(c[3][1]);
  lookups.levels = bits_of(c[3][2]);
  lookups.wrap_u = bits_of(c[3][3]) & Ints<N>(0xff);
  lookups.wrap_v = Ints<N>(bits_of(c[3][3]).v >> 8);
  return lookups;
}

/// Applies the textures to untextured surfaces in the lanes of `on`; returns the lanes that were
/// completed.
template <std::size_t N>
Mask<N> apply_maps(const SegmentLanes<N>& segments, const TriangleLanes<N>& at,
                   const MapRows<N>& rows, Mask<N> on, LaneHits<N>& out) {
  Floats<N> c[4][4];
  transpose_rows(rows.row, c);
  const TextureLookups<N> lookups = map_lookups(segments, at, rows, c, out.cone_width_m);
  Texture::Taps taps[N];
  on = find_taps(lookups, on, taps);

  Vec3s<N> color(Vec3{1, 1, 1});
  Floats<N> roughness(1);
  Floats<N> metallic(1);
  Vec3s<N> normal(Vec3{0, 0, 1});
  for (unsigned rest = on.bits(); rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    const LaneMaps& maps = *rows.maps[k];
    if (maps.base_color != nullptr) {
      const Vec4 t = maps.finest_color == nullptr
                         ? maps.base_color->read(taps[k])
                         : maps.base_color->sample({.uv = {lookups.uv.x.v[k], lookups.uv.y.v[k]},
                                                    .wrap_u = maps.finest_color->wrap_u,
                                                    .wrap_v = maps.finest_color->wrap_v});
      color.set(k, {t.x, t.y, t.z});
    }
    if (maps.metallic_roughness != nullptr) {
      const Vec4 t = maps.metallic_roughness->read(taps[k]);
      roughness.v[k] = t.y;
      metallic.v[k] = t.z;
    }
    if (maps.normal != nullptr) {
      const Vec4 t = maps.normal->read(taps[k]);
      normal.set(k, {2 * t.x - 1, 2 * t.y - 1, 2 * t.z - 1});
    }
  }
  Vec3s<N> coat_normal(Vec3{0, 0, 1});
  if (out.layered != 0) {
    read_layers(rows, taps, out.layered & on.bits(), out.layers, coat_normal);
  }
  SurfaceLanes<N>& s = out.surface;
  const Vec3s<N> tinted = Vec3s<N>(c[2][0], c[2][1], c[2][2]) * color;
  s.base_color =
      select(on, Vec3s<N>(clamp01(tinted.x), clamp01(tinted.y), clamp01(tinted.z)), s.base_color);
  s.roughness = select(on, clamp01(c[2][3] * roughness), s.roughness);
  s.alpha = select(on, max(s.roughness * s.roughness, Floats<N>(1e-4F)), s.alpha);
  s.metallic = select(on, clamp01(c[1][3] * metallic), s.metallic);

  Corners<Vec3s<N>> tangents;
  Floats<N> hand(0);
  for (std::size_t k = 0; k < 3; ++k) {
    Floats<N> behind;
    tangents[k] = gather(rows.tangents[k], behind);
    hand = hand + behind * (k == 0 ? at.b.x : k == 1 ? at.b.y : at.b.z);
  }
  const Vec3s<N> tangent = normalize_or(blend(tangents, at.b), Vec3s<N>(Vec3{}));
  const Mask<N> is_turned = on & (dot(tangent, tangent) > Floats<N>(0));
  if (is_turned.any()) {
    const Floats<N> sign = select(hand < Floats<N>(0), -at.mirror, at.mirror);
    const Vec3s<N> bitangent = cross(at.shading, tangent) * sign;
    const auto turn = [&](Vec3s<N> texel, Vec3s<N>& shading) {
      const Vec3s<N> mapped =
          normalize_or(tangent * texel.x + bitangent * texel.y + at.shading * texel.z, at.shading);
      shading = select(is_turned, facing(mapped * at.side, -segments.direction), shading);
    };
    turn({normal.x * c[1][2], normal.y * c[1][2], normal.z}, s.normal);
    if (out.layered != 0) {
      turn(coat_normal, out.layers.clearcoat_normal);
    }
  }
  return on;
}

}  // namespace core
