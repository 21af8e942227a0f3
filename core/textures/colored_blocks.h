/// ColoredBlocks: marks squares of texels in which a texture is entirely black.
#pragma once

#include <vector>

#include "core/textures/texture.h"

namespace core {

class ColoredBlocks {
 public:
  explicit ColoredBlocks(const Texture& texture);

  /// Returns true only if every texel that Texture::sample() reads at the finest level, for uv in
  /// the box, is black. May return false if these are black but nearby ones are not.
  bool is_black(Vec2 uv_low, Vec2 uv_high, TextureWrap wrap_u, TextureWrap wrap_v) const;

 private:
  int width_;
  int height_;
  int columns_;                ///< blocks per row
  std::vector<bool> colored_;  ///< per block, row by row
  bool any_ = false;
};

}  // namespace core
