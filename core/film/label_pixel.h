/// LabelPixel: what the ray through the centre of a pixel meets. MattePixel: what its samples do.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/math/vec.h"

namespace core {

/// Ids count from 1; all zero where the ray meets nothing.
struct LabelPixel {
  std::uint32_t object = 0;     ///< 1 + number of the file's node
  std::uint32_t instance = 0;   ///< within the range of the object
  std::uint32_t material = 0;   ///< 1 + number of the file's material
  std::uint32_t primitive = 0;  ///< 1 + number among the primitives of all meshes
  Vec3 position;                ///< world, metres
  Vec2 uv;                      ///< first set of texture coordinates
  Vec2 motion;                  ///< MotionTarget::motion()
};

/// Ids of Cryptomatte that a pixel keeps: six ranks in three layers, its usual depth.
inline constexpr std::size_t kMatteRanks = 6;

/// Samples of each half that met what has this id.
struct MatteRank {
  std::uint32_t id = 0;  ///< matte_id(); 0: this place is free
  std::array<std::uint32_t, 2> hits{};
};

/// By id; free places come last, so that equal counts are equal bits. A seventh id is not counted.
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
