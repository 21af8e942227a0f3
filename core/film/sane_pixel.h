/// is_sane: whether a renderer can have made values that were read from a file or a message. Every
/// type of core/film/tile_planes.h has a function.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/film/film.h"
#include "core/film/tile_planes.h"

namespace core {

/// samples: of the pixel, in all its replicates.
inline bool is_sane(const ReplicatePixel& p, std::uint64_t /*samples*/) {
  const bool finite = std::isfinite(p.mean_r) && std::isfinite(p.mean_g) &&
                      std::isfinite(p.mean_b) && std::isfinite(p.mean_alpha) &&
                      std::isfinite(p.m2_luminance);
  const bool empty =
      p.mean_r == 0 && p.mean_g == 0 && p.mean_b == 0 && p.mean_alpha == 0 && p.m2_luminance == 0;
  return finite && (p.count > 0 || empty);
}

inline bool is_sane(const AuxPixel& p, std::uint64_t samples) {
  const Vec3 n = p.normal_world;
  return is_finite(p.albedo) && std::isfinite(n.x) && std::isfinite(n.y) && std::isfinite(n.z) &&
         std::isfinite(p.depth_m) && p.hits <= samples;
}

inline bool is_sane(const PixelPlan& p, std::uint64_t /*samples*/) { return p.from <= p.to; }

inline bool is_sane(const PilotPixel& p, std::uint64_t /*samples*/) {
  return is_finite(p.mean) && is_finite(p.m2) && std::isfinite(p.rays);
}

inline bool is_sane(const ReplicateFit& f, std::uint64_t /*samples*/) {
  return std::isfinite(f.n) && std::isfinite(f.x) && std::isfinite(f.xx) && is_finite(f.y) &&
         is_finite(f.xy) && is_finite(f.coefficient);
}

inline bool is_sane(const Rgb& share, std::uint64_t /*samples*/) { return is_finite(share); }

inline bool is_sane(const FirstHitPixel& p, std::uint64_t /*samples*/) {
  return is_finite(p.position) && std::isfinite(p.uv.x) && std::isfinite(p.uv.y) &&
         !std::isinf(p.motion.x) && !std::isinf(p.motion.y);
}

/// Returns whether ids are in order and each has some of the samples.
inline bool is_sane(const MattePixel& p, std::uint64_t samples) {
  std::uint64_t hits = 0;
  std::uint32_t last = 0;
  for (const MatteRank& rank : p) {
    const std::uint64_t here = std::uint64_t{rank.hits[0]} + rank.hits[1];
    if (rank.id == 0 ? here != 0 : rank.id <= last || here == 0) {
      return false;
    }
    hits += here;
    last = rank.id == 0 ? ~0U : rank.id;
  }
  return hits <= samples;
}

inline bool is_sane(float z_depth, std::uint64_t /*samples*/) { return std::isfinite(z_depth); }

/// All values of a tile. Pre: its arrays have the lengths for its pixels, or none.
inline bool is_sane(const TileState& state, std::size_t replicates) {
  const std::size_t pixels = state.pixels.size() / replicates;
  bool sane = true;
  for (std::size_t pixel = 0; pixel < pixels && sane; ++pixel) {
    std::uint64_t samples = 0;
    for (std::size_t r = 0; r < replicates; ++r) {
      samples += state.pixels[pixel * replicates + r].count;
    }
    for_each_plane([&](const auto& plane) {
      const auto& values = state.*plane.values;
      const std::size_t per_pixel = values.size() / pixels;
      const auto* first = values.data() + pixel * per_pixel;
      sane = sane && std::all_of(first, first + per_pixel,
                                 [samples](const auto& value) { return is_sane(value, samples); });
    });
  }
  return sane;
}

}  // namespace core
