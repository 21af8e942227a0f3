/// FirstHitPixel: what the ray through a pixel's centre hits. MattePixel: what the pixel's samples
/// hit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/math/vec.h"

namespace core {

/// Ids count from 1; all are zero if the ray hits nothing.
struct FirstHitPixel {
  std::uint32_t object = 0;     ///< 1 + index of the node in the file
  std::uint32_t instance = 0;   ///< index within the object
  std::uint32_t material = 0;   ///< 1 + index of the material in the file
  std::uint32_t primitive = 0;  ///< 1 + index among the primitives of all meshes
  Vec3 position;                ///< world, metres
  Vec2 uv;                      ///< first texture coordinate set
  Vec2 motion;                  ///< Motion::of()
};

/// Cryptomatte ids stored per pixel: six ranks in three layers, the usual depth.
inline constexpr std::size_t kMatteRanks = 6;

/// Counts the samples of each half that hit objects (or materials) with this id.
struct MatteRank {
  std::uint32_t id = 0;  ///< matte_id(); 0: unused entry
  std::array<std::uint32_t, 2> hits{};
};

/// Sorted by id with unused entries last, so that equal counts give equal bits. Further ids are not
/// counted.
using MattePixel = std::array<MatteRank, kMatteRanks>;

inline void add_matte(MattePixel& pixel, const MatteRank& more) noexcept {
  std::size_t at = 0;
  while (at < kMatteRanks && pixel[at].id != 0 && pixel[at].id < more.id) {
    ++at;
  }
  const bool is_there = at < kMatteRanks && pixel[at].id == more.id;
  if (!is_there) {
    if (pixel.back().id != 0) {
      return;
    }
    for (std::size_t i = kMatteRanks - 1; i > at; --i) {
      pixel[i] = pixel[i - 1];
    }
    pixel[at] = {more.id, {}};
  }
  pixel[at].hits[0] += more.hits[0];
  pixel[at].hits[1] += more.hits[1];
}

}  // namespace core
