/// ColoredBlocks: where a texture is wholly black, known for squares of texels.
#pragma once

#include <vector>

#include "core/textures/texture.h"

namespace core {

class ColoredBlocks {
 public:
  explicit ColoredBlocks(const Texture& texture);

  /// Is every texel black that Texture::sample() reads at the finest level for uv within the box?
  /// May be false where the texels are black but others nearby are not.
  bool is_black(Vec2 uv_low, Vec2 uv_high, TextureWrap wrap_u, TextureWrap wrap_v) const;

 private:
  int width_;
  int height_;
  int columns_;                ///< blocks in a row
  std::vector<bool> colored_;  ///< by block, row by row
  bool any_ = false;
};

}  // namespace core
