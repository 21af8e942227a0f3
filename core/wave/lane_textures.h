/// Texture::find_taps() in lanes, for filtered lookups with coordinates in range.
#pragma once

#include <bit>
#include <cstddef>

#include "core/math/lane_math.h"
#include "core/textures/texture.h"

namespace core {

/// Texture::Lookup and the size of the texture.
template <std::size_t N>
struct TextureLookups {
  Vec2s<N> uv;
  Vec2s<N> across, along;
  Mask<N> is_sharp;  ///< taps_max is kTextureTapsMax, else 1
  Ints<N> wrap_u, wrap_v;
  Ints<N> width, height, levels;
};

namespace texture_detail {

/// Applies the wrap mode to a coordinate; the result is in [0, 1] up to rounding.
template <std::size_t N>
Floats<N> wrapped(Floats<N> u, Ints<N> mode) {
  const Floats<N> one(1);
  const Floats<N> two(2);
  const auto is = [mode](TextureWrap wrap) { return mode == Ints<N>(static_cast<int>(wrap)); };
  const Floats<N> repeated = u - to_floats(floor_of(u));
  const Floats<N> twice = u - two * to_floats(floor_of(u * Floats<N>(0.5F)));
  const Floats<N> mirrored = min(twice, two - twice);
  return select(is(TextureWrap::kClampToEdge), clamp01(u),
                select(is(TextureWrap::kMirroredRepeat), mirrored, repeated));
}

/// Texels i and i + 1 of n along an axis. Between -1 and n mirrored axes read the same texels as
/// clamped ones.
template <std::size_t N>
struct Pair {
  Ints<N> first, second;
  Pair(Ints<N> i, Ints<N> n, Ints<N> mode) {
    const Mask<N> repeats = mode == Ints<N>(static_cast<int>(TextureWrap::kRepeat));
    const auto texel = [&](Ints<N> k) {
      const Ints<N> up = select(k < Ints<N>(0), k + n, k);
      return within(select(repeats, select(up < n, up, up - n), k), n);
    };
    first = texel(i);
    second = texel(i + Ints<N>(1));
  }
};

/// Adds the four texels of a level around uv with their weights.
template <std::size_t N>
void add_taps(const TextureLookups<N>& at, Vec2s<N> uv, Ints<N> level, Floats<N> weight,
              Mask<N> taken, Texture::Taps (&taps)[N]) {
  using Tap = Texture::Taps::Tap;
  const Floats<N> half(0.5F);
  const auto size = [level](Ints<N> n) {
    const Ints<N> shifted(n.v >> level.v);
    return select(shifted < Ints<N>(1), Ints<N>(1), shifted);
  };
  const Ints<N> width = size(at.width);
  const Ints<N> height = size(at.height);
  const Floats<N> x = wrapped(uv.x, at.wrap_u) * to_floats(width) - half;
  const Floats<N> y = wrapped(uv.y, at.wrap_v) * to_floats(height) - half;
  const Ints<N> column = floor_of(x);
  const Ints<N> row = floor_of(y);
  const Pair<N> columns(column, width, at.wrap_u);
  const Pair<N> rows(row, height, at.wrap_v);
  const Ints<N> upper = rows.first * width;
  const Ints<N> lower = rows.second * width;
  static_assert(sizeof(Tap) == 8 * sizeof(float));
  alignas(32) float parts[8][N];
  const auto keep = [&parts](std::size_t part, Floats<N> value) { store(parts[part], value); };
  keep(0, floats_of(level));
  keep(1, floats_of(upper + columns.first));
  keep(2, floats_of(upper + columns.second));
  keep(3, floats_of(lower + columns.first));
  keep(4, floats_of(lower + columns.second));
  keep(5, x - to_floats(column));
  keep(6, y - to_floats(row));
  keep(7, weight);
  for (unsigned rest = taken.bits(); rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    float tap[8];
    for (std::size_t part = 0; part < 8; ++part) {
      tap[part] = parts[part][k];
    }
    std::memcpy(&taps[k].tap[static_cast<std::size_t>(taps[k].count++)], tap, sizeof tap);
  }
}

}  // namespace texture_detail

/// Evaluates the lanes of `on`. Skips lanes whose coordinates or footprints exceed the integer
/// range of lanes; returns the lanes evaluated.
template <std::size_t N>
Mask<N> find_taps(const TextureLookups<N>& at, Mask<N> on, Texture::Taps (&taps)[N]) {
  const Floats<N> one(1);
  const Floats<N> zero(0);
  const Floats<N> w = to_floats(at.width);
  const Floats<N> h = to_floats(at.height);
  const Vec2s<N> p = {at.across.x * w, at.across.y * h};
  const Vec2s<N> q = {at.along.x * w, at.along.y * h};
  const Floats<N> p2 = p.x * p.x + p.y * p.y;
  const Floats<N> q2 = q.x * q.x + q.y * q.y;
  const Floats<N> longest2 = max(p2, q2);
  const Floats<N> far_out(1e5F);
  on = on & (abs(at.uv.x) < far_out) & (abs(at.uv.y) < far_out) & (longest2 < Floats<N>(1e14F)) &
       (p2 == p2) & (q2 == q2);
  const Mask<N> is_magnified = longest2 <= one;
  const Floats<N> area = abs(p.x * q.y - p.y * q.x);
  const Floats<N> longest = sqrt(max(longest2, one));
  const Floats<N> width =
      max(max(area / longest, longest * Floats<N>(1.0F / kTextureTapsMax)), one);
  const Mask<N> is_long = at.is_sharp & ~is_magnified;
  // std::ceil(longest / width - 0.25F)
  const Ints<N> ceiled = Ints<N>(0) - floor_of(Floats<N>(0.25F) - longest / width);
  const Ints<N> reads = select(is_long, within(ceiled, Ints<N>(kTextureTapsMax + 1)), Ints<N>(1));
  const Floats<N> blurred =
      select(at.is_sharp, log2(width), Floats<N>(0.5F) * log2(max(area, one)));
  const Ints<N> last = at.levels - Ints<N>(1);
  const Floats<N> lod = min(select(is_magnified, zero, blurred), to_floats(last));
  const Ints<N> low = truncated(lod);
  const Floats<N> between = lod - to_floats(low);
  const Mask<N> blends = ~(between < Floats<N>(1e-3F)) & (low < last);
  const Floats<N> share = one / to_floats(select(reads < Ints<N>(1), Ints<N>(1), reads));
  const Mask<N> is_along = q2 > p2;
  const Vec2s<N> way = {select(is_along, at.along.x, at.across.x),
                        select(is_along, at.along.y, at.across.y)};
  for (Texture::Taps& each : taps) {
    each.count = 0;
  }
  Mask<N> open = on;
  for (int i = 0; open.any(); open = on & (Ints<N>(++i) < reads)) {
    const Floats<N> offset =
        (Floats<N>(static_cast<float>(i)) + Floats<N>(0.5F)) * share - Floats<N>(0.5F);
    const Vec2s<N> uv = {at.uv.x + way.x * offset, at.uv.y + way.y * offset};
    texture_detail::add_taps(at, uv, low, select(blends, share * (one - between), share), open,
                             taps);
    const Mask<N> mixed = open & blends;
    if (mixed.any()) {
      texture_detail::add_taps(at, uv, low + Ints<N>(1), share * between, mixed, taps);
    }
  }
  return on;
}

}  // namespace core
