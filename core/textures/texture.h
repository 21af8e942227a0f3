/// Texture: decoded pixels with a mip pyramid, sampled in linear light.
///
/// 8-bit images stay 8-bit (sRGB decoded by table at each tap); others are floats. Level 0 is the
/// image; each next level halves it by a box filter in linear light, alpha-unweighted as glTF's
/// textures are not premultiplied. Read-only after creation, so no locks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/description/scene_description.h"
#include "core/image_io/image.h"
#include "core/math/vec.h"

namespace core {

/// The texel that texel i of an axis of n stands for: itself within [0, n), else as the mode says.
int wrapped_texel(int i, int n, TextureWrap mode);

/// Footprints longer than this many times their width are blurred across as well.
inline constexpr int kTextureTapsMax = 8;

class Texture {
 public:
  /// srgb: 8- and 16-bit RGB values are sRGB-encoded; alpha never is. Grey is spread to RGB.
  static std::shared_ptr<const Texture> create(const Image& image, bool srgb);

  struct Lookup {
    Vec2 uv = {0, 0};  ///< v = 0 at the top row
    /// Axes of the footprint's ellipse, in uv: its whole width and length, either first. Zero: the
    /// finest level.
    Vec2 across = {0, 0};
    Vec2 along = {0, 0};
    int taps_max =
        1;  ///< 1: a round footprint of the same area; more: that many reads along the longer axis
    TextureWrap wrap_u = TextureWrap::kRepeat;
    TextureWrap wrap_v = TextureWrap::kRepeat;
    bool nearest = false;
  };
  /// Trilinear; several reads in a row where a footprint is long; nearest when asked and the
  /// texture is magnified.
  Vec4 sample(const Lookup& at) const noexcept;

  int width() const noexcept { return levels_[0].width; }
  int height() const noexcept { return levels_[0].height; }
  std::size_t bytes() const noexcept;
  /// Has the finest level's texel no colour, whatever its alpha?
  bool is_black(int x, int y) const noexcept {
    const Level& level = levels_[0];
    const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(level.width) +
                    static_cast<std::size_t>(x);
    if (level.floats.empty()) {
      return (level.rgba8[at] & 0xffffffU) == 0;
    }
    const Vec4& c = level.floats[at];
    return c.x == 0 && c.y == 0 && c.z == 0;
  }
  /// Mean over level 0.
  Vec4 mean() const noexcept { return mean_; }

 private:
  struct Level {
    int width = 0;
    int height = 0;
    std::vector<std::uint32_t> rgba8;
    std::vector<Vec4> floats;
  };
  Texture() = default;
  Vec4 texel(const Level& level, int x, int y) const noexcept;
  Vec4 bilinear(const Level& level, const Lookup& at) const noexcept;
  Vec4 trilinear(float lod, const Lookup& at) const noexcept;

  std::vector<Level> levels_;
  bool srgb_ = false;
  Vec4 mean_;
};

}  // namespace core
