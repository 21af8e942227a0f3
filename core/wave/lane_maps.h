/// Textures of colour, metallic-roughness, normals, clearcoat and sheen in lanes, as in
/// core/materials/shade.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "core/materials/texture_places.h"
#include "core/materials/textured.h"
#include "core/wave/lane_rows.h"
#include "core/wave/lane_surfaces.h"
#include "core/wave/lane_textures.h"

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

/// The textures of a mapped material.
struct alignas(64) LaneMaps {
  /// Lookup parameters: transform of uv; as bits, wrap modes, width, height and levels.
  float at[12] = {};
  const Material* material = nullptr;  ///< null: it has no texture that lanes read
  bool has_layers = false;             ///< some texture is of clearcoat or sheen

  /// One texel.
  LaneMaps() { std::fill_n(at + 7, 3, std::bit_cast<float>(1)); }
  explicit LaneMaps(const Material& m) : LaneMaps() {
    if (const TextureSlot* first = first_mapped(m)) {
      const TextureDescription& d = first->description;
      std::ranges::copy(d.uv_transform, at);
      const int sizes[4] = {static_cast<int>(d.wrap_u) | static_cast<int>(d.wrap_v) << 8,
                            first->texture->width(), first->texture->height(),
                            first->texture->level_count()};
      std::memcpy(at + 6, sizes, sizeof sizes);
      material = &m;
      has_layers = std::ranges::any_of(kMaterialMaps, [&m](const MaterialMap& map) {
        return map.is_layer && map.in_lanes == MapInLanes::kRead &&
               (m.*map.slot).texture != nullptr;
      });
    }
  }
};

/// The point of a lane, as in core/materials/textured.h.
struct LanePoint {
  const Texture::Taps& taps;
  Vec2 uv;

  Vec4 read(const TextureSlot& slot) const {
    return slot.texture == nullptr ? Vec4{1, 1, 1, 1} : slot.texture->read(taps);
  }
  Vec4 read_finest(const TextureSlot& slot) const {
    const TextureDescription& d = slot.description;
    return slot.texture->sample({.uv = uv, .wrap_u = d.wrap_u, .wrap_v = d.wrap_v});
  }
};

/// The lanes' triangles at their hits.
template <std::size_t N>
struct TriangleLanes {
  FaceOf<Floats<N>> face;
  Vec3s<N> shading;  ///< interpolated normal of the front
  Floats<N> side;    ///< 1 in front, else -1
};

/// Except for f0 and f90.
template <std::size_t N>
void set_lane(SurfaceLanes<N>& s, std::size_t k, const BsdfParameters& b) {
  s.base_color.set(k, {b.base_color.r, b.base_color.g, b.base_color.b});
  s.metallic.v[k] = b.metallic;
  s.roughness.v[k] = b.roughness;
  s.alpha.v[k] = b.alpha_y;
}
/// Except for the normal of the coat.
template <std::size_t N>
void set_lane(LayerLanes<N>& layers, std::size_t k, const SurfaceLayers& l) {
  layers.clearcoat.v[k] = l.clearcoat;
  layers.clearcoat_roughness.v[k] = l.clearcoat_roughness;
  layers.sheen_color.set(k, {l.sheen_color.r, l.sheen_color.g, l.sheen_color.b});
  layers.sheen_roughness.v[k] = l.sheen_roughness;
}

/// Addresses of the lanes' maps, and of the corners of their triangles.
template <std::size_t N>
struct MapRows {
  const LaneMaps* maps[N];
  const float* tangents[3][N];
  Vec4 turned[3][N];
  alignas(32) float u[3][N];
  alignas(32) float v[3][N];

  MapRows() {
    static const LaneMaps kNone;
    for (std::size_t k = 0; k < N; ++k) {
      maps[k] = &kNone;
      for (std::size_t c = 0; c < 3; ++c) {
        tangents[c][k] = kNothing;
        u[c][k] = v[c][k] = 0;
      }
    }
  }
};

/// Where and how wide the maps are read.
template <std::size_t N>
[[gnu::always_inline]] inline TextureLookups<N> map_lookups(const SegmentLanes<N>& segments,
                                                            const FaceOf<Floats<N>>& face,
                                                            const MapRows<N>& rows,
                                                            Floats<N> cone_width_m) {
  Floats<N> c[3][4];
  for (std::size_t part = 0; part < 3; ++part) {
    const float* from[N];
    for (std::size_t k = 0; k < N; ++k) {
      from[k] = rows.maps[k]->at + 4 * part;
    }
    transpose(from, c[part]);
  }
  Corners<Vec2s<N>> corner;
  for (std::size_t k = 0; k < 3; ++k) {
    corner[k] = {load<N>(rows.u[k]), load<N>(rows.v[k])};
  }
  UvOf<Floats<N>> uv = {
      blend(corner, face.b), corner[1] - corner[0], corner[2] - corner[0], {}, {}};
  find_edge_ways(face, uv.to_edge1, uv.to_edge2);
  const std::array<Floats<N>, 6> transform = {c[0][0], c[0][1], c[0][2], c[0][3], c[1][0], c[1][1]};
  const TexturePlaceOf<Floats<N>> place = texture_place(
      transform, uv, footprint_axes(face.geometric, -segments.direction, cone_width_m));
  return {place.uv,
          place.across,
          place.along,
          ~(segments.is_sharp == Ints<N>(0)),
          bits_of(c[1][2]) & Ints<N>(0xff),
          bits_of(c[1][2]) >> 8,
          bits_of(c[1][3]),
          bits_of(c[2][0]),
          bits_of(c[2][1])};
}

/// Applies the textures to untextured surfaces in the lanes of `on`; returns the lanes that were
/// completed.
template <std::size_t N>
Mask<N> apply_maps(const SegmentLanes<N>& segments, const TriangleLanes<N>& at,
                   const MapRows<N>& rows, Mask<N> on, LaneHits<N>& out) {
  const TextureLookups<N> lookups = map_lookups(segments, at.face, rows, out.cone_width_m);
  Texture::Taps taps[N];
  on = find_taps(lookups, on, taps);

  Vec3s<N> normal(Vec3{0, 0, 1});
  Vec3s<N> coat_normal = normal;
  for (unsigned rest = on.bits(); rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    const Material& m = *rows.maps[k]->material;
    const LanePoint point = {taps[k], {lookups.uv.x.v[k], lookups.uv.y.v[k]}};
    BsdfParameters b;
    set_base(m, {1, 1, 1, 1}, point, b);
    set_lane(out.surface, k, b);
    if (m.normal.texture != nullptr) {
      normal.set(k, map_normal(point.read(m.normal), m.factors.normal_scale));
    }
    if ((out.layered >> k & 1U) != 0 && rows.maps[k]->has_layers) {
      BsdfLayers layers;
      set_layers(m, point, layers);
      set_lane(out.layers, k, layers);
      if (m.clearcoat_normal.texture != nullptr) {
        coat_normal.set(
            k, map_normal(point.read(m.clearcoat_normal), m.factors.clearcoat_normal_scale));
      }
    }
  }

  const FaceOf<Floats<N>>& face = at.face;
  Corners<Vec3s<N>> tangents;
  Floats<N> hand(0);
  for (std::size_t k = 0; k < 3; ++k) {
    Floats<N> behind;
    tangents[k] = gather(rows.tangents[k], behind);
    hand = hand + behind * (k == 0 ? face.b.x : k == 1 ? face.b.y : face.b.z);
  }
  const Vec3s<N> tangent = normalize_or(blend(tangents, face.b), Vec3s<N>(Vec3{}));
  const Mask<N> is_turned = on & (dot(tangent, tangent) > Floats<N>(0));
  if (is_turned.any()) {
    const Floats<N> sign = select(hand < Floats<N>(0), -face.mirror, face.mirror);
    const Vec3s<N> bitangent = cross(at.shading, tangent) * sign;
    const auto turn = [&](Vec3s<N> of_map, Vec3s<N>& shading) {
      const Vec3s<N> mapped = mapped_normal<Floats<N>>(at.shading, tangent, bitangent, of_map);
      shading = select(is_turned, facing(mapped * at.side, -segments.direction), shading);
    };
    turn(normal, out.surface.normal);
    if (out.layered != 0) {
      turn(coat_normal, out.layers.clearcoat_normal);
    }
  }
  return on;
}

}  // namespace core
