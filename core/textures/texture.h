/// Texture: decoded pixels with a mip pyramid, sampled in linear light.
///
/// 8-bit images stay 8-bit (sRGB is decoded by table at each tap); others are stored as floats.
/// Level 0 is the image; each next level halves it with a box filter in linear light, not weighted
/// by alpha because glTF's textures are not premultiplied. Read-only after creation, so it needs no
/// locks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/paged_memory.h"
#include "core/description/scene_description.h"
#include "core/image_io/image.h"
#include "core/math/intrinsics.h"
#include "core/math/vec.h"
#include "core/textures/texture_taps.h"

namespace core {

/// Returns the texel of index i on an axis of n texels: i itself within [0, n), else by the wrap
/// mode.
int wrapped_texel(int i, int n, TextureWrap mode);

/// Returns all pixels of an image in linear light, row 0 on top. Grey is copied to RGB; alpha is 1
/// if missing. srgb: as for Texture::create().
PagedVector<Vec4> linear_texels(const Image& image, bool srgb);

class Texture {
 public:
  /// srgb: 8- and 16-bit RGB values are sRGB-encoded; alpha never is. Grey is copied to RGB.
  static std::shared_ptr<const Texture> create(const Image& image, bool srgb);

  struct Lookup {
    Vec2 uv = {0, 0};  ///< v = 0 at the top row
    /// Axes of the elliptical footprint in uv: full width and length, in either order. Zero selects
    /// the finest level.
    Vec2 across = {0, 0};
    Vec2 along = {0, 0};
    /// 1: a round footprint of the same area; kTextureTapsMax: up to as many taps along the longer
    /// axis.
    int taps_max = 1;
    TextureWrap wrap_u = TextureWrap::kRepeat;
    TextureWrap wrap_v = TextureWrap::kRepeat;
    bool nearest = false;
  };
  /// The texels and weights of a lookup; the same for all textures of one size.
  struct Taps {
    using Tap = TextureTap<float>;
    int count = 0;  ///< 0: uses the texture's mean
    std::array<Tap, 2 * kTextureTapsMax> tap;
  };
  /// Finds the taps: trilinear; several in a row for long footprints; nearest if requested and the
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
  /// Returns the bytes that always take memory: levels of kPagedBytes do not.
  std::size_t bytes() const noexcept;
  /// Returns whether the texel of the finest level is black, whatever its alpha.
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
  /// Returns whether alpha is 1 everywhere.
  bool is_opaque() const noexcept { return is_opaque_; }
  /// Returns the alpha of a texel of the finest level.
  float alpha(int x, int y) const noexcept { return texel(levels_[0], x, y).w; }
  /// Returns the mean over level 0.
  Vec4 mean() const noexcept { return mean_; }

 private:
  struct Level {
    int width = 0;
    int height = 0;
    PagedVector<std::uint32_t> rgba8;
    PagedVector<Vec4> floats;
  };
  Texture() = default;
  Vec4 texel(const Level& level, int x, int y) const noexcept;
  template <typename TexelAt>
  __m128 sum(const Taps& taps, const TexelAt& texel_at) const noexcept;

  std::vector<Level> levels_;
  bool srgb_ = false;
  bool is_opaque_ = false;
  Vec4 mean_;
};

}  // namespace core
