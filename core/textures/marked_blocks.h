/// MarkedBlocks: squares of texels in which some texel is marked, for example not black.
#pragma once

#include <vector>

#include "core/textures/texture.h"

namespace core {

class MarkedBlocks {
 public:
  /// is_marked(x, y): of the texels.
  template <typename IsMarked>
  MarkedBlocks(int width, int height, const IsMarked& is_marked) : MarkedBlocks(width, height) {
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        if (is_marked(x, y)) {
          mark(x, y);
        }
      }
    }
  }

  template <typename IsMarked>
  MarkedBlocks(const Texture& texture, const IsMarked& is_marked)
      : MarkedBlocks(texture.width(), texture.height(), is_marked) {}

  /// Returns false only if no texel is marked that Texture::sample() reads at the finest level, for
  /// uv in the box. May return true if these are not marked but nearby ones are.
  bool has_mark(Vec2 uv_low, Vec2 uv_high, TextureWrap wrap_u, TextureWrap wrap_v) const;

 private:
  MarkedBlocks(int width, int height);
  void mark(int x, int y);

  int width_;
  int height_;
  int columns_;               ///< blocks per row
  std::vector<bool> marked_;  ///< per block, row by row
  bool any_ = false;
};

}  // namespace core
