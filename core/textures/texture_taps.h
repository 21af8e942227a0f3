/// Where filtered lookups read textures, for one lookup or SIMD lanes (core/math/generic.h).
#pragma once

#include "core/description/scene_description.h"
#include "core/math/generic.h"

namespace core {

/// Footprints longer than this multiple of their width are also blurred across.
inline constexpr int kTextureTapsMax = 8;
/// Farther out, coordinates would overflow the integer texel: 16,384 times this is below 2^31.
inline constexpr float kTextureFarOut = 1e5F;

/// Texture::Lookup and the size of the texture.
template <typename F>
struct TextureLookup {
  Vec2Of<F> uv;
  Vec2Of<F> across, along;
  MaskOf<F> is_sharp;  ///< taps_max is kTextureTapsMax, else 1
  IntOf<F> wrap_u, wrap_v;
  IntOf<F> width, height, levels;

  /// The footprint's axes in texels.
  Vec2Of<F> across_texels() const noexcept { return in_texels(across); }
  Vec2Of<F> along_texels() const noexcept { return in_texels(along); }

 private:
  Vec2Of<F> in_texels(Vec2Of<F> v) const noexcept {
    return {v.x * to_floats(width), v.y * to_floats(height)};
  }
};

/// Four texels of a level, in rows.
template <typename F>
struct TextureTap {
  IntOf<F> level, i00, i10, i01, i11;  ///< i10: right of i00; i01: below it
  F right, down;                       ///< interpolation weights in [0, 1]
  F weight;
};

namespace texture_detail {

template <typename I>
auto has(I mode, TextureWrap wrap) {
  return mode == I(static_cast<int>(wrap));
}

/// Applies the wrap mode to a coordinate; the result is in [0, 1] up to rounding.
template <typename F>
F wrapped(F u, IntOf<F> mode) {
  const F repeated = u - to_floats(floor_of(u));
  const MaskOf<F> repeats = has(mode, TextureWrap::kRepeat);
  if (all(repeats)) {
    return repeated;
  }
  const F twice = u - 2 * to_floats(floor_of(u * 0.5F));
  const F mirrored = min(twice, 2 - twice);
  return select(repeats, repeated,
                select(has(mode, TextureWrap::kClampToEdge), clamp01(u), mirrored));
}

/// Returns texel i of n along an axis. Pre: i is in [-1, n]: there mirrored axes read the same
/// texels as clamped ones.
template <typename I>
I near_texel(I i, I n, I mode) {
  const I up = select(i < 0, i + n, i);
  return within(select(has(mode, TextureWrap::kRepeat), select(up < n, up, up - n), i), n);
}

/// Returns the four texels of a level around uv.
template <typename F>
TextureTap<F> tap_at(const TextureLookup<F>& at, Vec2Of<F> uv, IntOf<F> level, F weight) {
  using I = IntOf<F>;
  const auto size = [level](I n) {
    const I halved = n >> level;
    return select(halved < 1, I(1), halved);
  };
  const I width = size(at.width);
  const I height = size(at.height);
  const F x = wrapped(uv.x, at.wrap_u) * to_floats(width) - 0.5F;
  const F y = wrapped(uv.y, at.wrap_v) * to_floats(height) - 0.5F;
  const I column = floor_of(x);
  const I row = floor_of(y);
  const I x0 = near_texel(column, width, at.wrap_u);
  const I x1 = near_texel(column + 1, width, at.wrap_u);
  const I y0 = near_texel(row, height, at.wrap_v) * width;
  const I y1 = near_texel(row + 1, height, at.wrap_v) * width;
  return {level, y0 + x0, y0 + x1, y1 + x0, y1 + x1, x - to_floats(column), y - to_floats(row),
          weight};
}

}  // namespace texture_detail

/// Calls put(mask, tap) for the taps of lookups in `on`: trilinear; several in a row for long
/// footprints. Leaves out lookups whose coordinates are far out, or whose footprints exceed the
/// range of integers or are no numbers; returns the others.
template <typename F, typename Put>
MaskOf<F> find_taps(const TextureLookup<F>& at, MaskOf<F> on, const Put& put) {
  using I = IntOf<F>;
  const Vec2Of<F> p = at.across_texels();
  const Vec2Of<F> q = at.along_texels();
  const F p2 = p.x * p.x + p.y * p.y;
  const F q2 = q.x * q.x + q.y * q.y;
  const F longest2 = max(p2, q2);
  on = on & (abs(at.uv.x) < kTextureFarOut) & (abs(at.uv.y) < kTextureFarOut) & (longest2 < 1e14F) &
       (p2 == p2) & (q2 == q2);
  if (!any(on)) {
    return on;
  }
  const MaskOf<F> is_magnified = longest2 <= 1;
  const MaskOf<F> is_long = at.is_sharp & opposite(is_magnified);
  const I last = at.levels - 1;
  F lod(0);
  I reads(1);
  F share(1);
  if (!all(is_magnified)) {
    const F area = abs(p.x * q.y - p.y * q.x);
    F blurred = max(area, F(1));
    if (any(is_long)) {
      const F longest = sqrt(longest2);
      const F width = max(max(area / longest, longest * (1.0F / kTextureTapsMax)), F(1));
      const I ceiled = 0 - floor_of(0.25F - longest / width);  // std::ceil(longest / width - 0.25F)
      reads = select(is_long, within(ceiled, I(kTextureTapsMax + 1)), I(1));
      share = 1 / to_floats(select(reads < 1, I(1), reads));
      blurred = select(is_long, width, blurred);
    }
    const F level = select(is_long, F(1), F(0.5F)) * log2(blurred);
    lod = min(select(is_magnified, F(0), level), to_floats(last));
  }
  const I low = truncated(lod);
  const F between = lod - to_floats(low);
  const MaskOf<F> blends = opposite(between < 1e-3F) & (low < last);
  const MaskOf<F> is_along = q2 > p2;
  const Vec2Of<F> way = {select(is_along, at.along.x, at.across.x),
                         select(is_along, at.along.y, at.across.y)};
  MaskOf<F> open = on;
  for (int i = 0; any(open); open = on & (I(++i) < reads)) {
    const F offset = (static_cast<float>(i) + 0.5F) * share - 0.5F;
    const Vec2Of<F> uv = {at.uv.x + way.x * offset, at.uv.y + way.y * offset};
    put(open, texture_detail::tap_at(at, uv, low, select(blends, share * (1 - between), share)));
    const MaskOf<F> mixed = open & blends;
    if (any(mixed)) {
      put(mixed, texture_detail::tap_at(at, uv, low + 1, share * between));
    }
  }
  return on;
}

}  // namespace core
