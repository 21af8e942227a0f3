#include "core/textures/marked_blocks.h"

#include <cmath>

namespace core {
namespace {

constexpr int kSide = 8;  ///< of a block: a map of 2048 x 2048 then takes 8 KB

/// Returns the blocks along one axis with texels read for coordinates in [low, high], each once
/// unless the texture repeats within; `size` texels. Empty: all of them.
std::vector<int> blocks_between(float low, float high, int size, TextureWrap mode) {
  // Bilinear reads reach half a texel to either side; one more texel covers rounding of
  // coordinates.
  const float first = std::floor(low * static_cast<float>(size) - 0.5F) - 1;
  const float last = std::floor(high * static_cast<float>(size) - 0.5F) + 2;
  // Beyond 2^23 a float cannot distinguish texels.
  if (!(std::fabs(first) < 0x1p23F && last - first < static_cast<float>(size))) {
    return {};
  }
  std::vector<int> blocks;
  for (int i = static_cast<int>(first); i <= static_cast<int>(last); ++i) {
    const int block = wrapped_texel(i, size, mode) / kSide;
    if (blocks.empty() || blocks.back() != block) {
      blocks.push_back(block);
    }
  }
  return blocks;
}

}  // namespace

MarkedBlocks::MarkedBlocks(int width, int height)
    : width_(width),
      height_(height),
      columns_((width_ + kSide - 1) / kSide),
      marked_(static_cast<std::size_t>(columns_) *
              static_cast<std::size_t>((height_ + kSide - 1) / kSide)) {}

void MarkedBlocks::mark(int x, int y) {
  marked_[static_cast<std::size_t>(y / kSide * columns_ + x / kSide)] = true;
  any_ = true;
}

bool MarkedBlocks::has_mark(Vec2 uv_low, Vec2 uv_high, TextureWrap wrap_u,
                            TextureWrap wrap_v) const {
  if (!any_) {
    return false;
  }
  const std::vector<int> across = blocks_between(uv_low.x, uv_high.x, width_, wrap_u);
  const std::vector<int> down = blocks_between(uv_low.y, uv_high.y, height_, wrap_v);
  if (across.empty() || down.empty()) {
    return true;
  }
  for (const int row : down) {
    for (const int column : across) {
      if (marked_[static_cast<std::size_t>(row * columns_ + column)]) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace core
