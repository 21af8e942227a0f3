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

#include <immintrin.h>

#include "core/description/scene_description.h"
#include "core/image_io/image.h"
#include "core/math/vec.h"

namespace core {

/// The texel that index i maps to on an axis of n: itself within [0, n), else by the wrap mode.
int wrapped_texel(int i, int n, TextureWrap mode);

/// Footprints longer than this many times their width are blurred across as well.
inline constexpr int kTextureTapsMax = 8;

/// All pixels of an image in linear light, row 0 on top; grey is spread to RGB, alpha is 1 where
/// there is none. srgb: as for Texture::create().
std::vector<Vec4> linear_texels(const Image& image, bool srgb);

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
  /// The texels that a lookup reads, with their weights; the same for all textures of one size.
  struct Taps {
    struct Tap {
      std::uint32_t level, i00, i10, i01, i11;  ///< i10: to the right of i00, i01: below it
      float right, down;                        ///< towards them, in [0, 1]
      float weight;
    };
    int count = 0;  ///< 0: the texture's mean
    std::array<Tap, 2 * kTextureTapsMax> tap;
  };
  /// Trilinear; several reads in a row where a footprint is long; nearest when asked and the
  /// texture is magnified.
  void find_taps(const Lookup& at, Taps& taps) const noexcept;
  Vec4 read(const Taps& taps) const noexcept;
  Vec4 sample(const Lookup& at) const noexcept {
    Taps taps;
    find_taps(at, taps);
    return read(taps);
  }

  int width() const noexcept { return levels_[0].width; }
  int height() const noexcept { return levels_[0].height; }
  int level_count() const noexcept { return static_cast<int>(levels_.size()); }
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
  void add_tap(std::uint32_t level, const Lookup& at, float weight, Taps& taps) const noexcept;
  template <typename TexelAt>
  __m128 sum(const Taps& taps, const TexelAt& texel_at) const noexcept;
  void add_taps(float lod, const Lookup& at, float weight, Taps& taps) const noexcept;

  std::vector<Level> levels_;
  bool srgb_ = false;
  Vec4 mean_;
};

}  // namespace core
