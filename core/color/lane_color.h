/// Colours in SIMD lanes, and the colour that goes with a number of core/math/generic.h.
#pragma once

#include <type_traits>

#include "core/color/rgb.h"
#include "core/math/generic.h"

namespace core {

/// Colours in lanes are Vec3s of red, green and blue.
template <typename F>
struct ColorType {
  using Type = Vec3Of<F>;
};
template <>
struct ColorType<float> {
  using Type = Rgb;
};
template <typename F>
using ColorOf = typename ColorType<F>::Type;

/// True for NaN.
template <std::size_t N>
Mask<N> is_not_black(Vec3s<N> c) {
  const Floats<N> zero(0);
  return ~((c.x == zero) & (c.y == zero) & (c.z == zero));
}
inline bool is_not_black(Rgb c) noexcept { return !is_black(c); }
template <std::size_t N>
Floats<N> luminance(Vec3s<N> c) {
  return kLuminance<float>[0] * c.x + kLuminance<float>[1] * c.y + kLuminance<float>[2] * c.z;
}
inline Rgb select(bool mask, Rgb yes, Rgb no) noexcept { return mask ? yes : no; }

template <typename F>
ColorOf<F> color_of(Rgb c) {
  if constexpr (std::is_same_v<F, float>) {
    return c;
  } else {
    return ColorOf<F>(F(c.r), F(c.g), F(c.b));
  }
}
template <typename F>
struct Channels {
  F red, green, blue;
};
inline Channels<float> channels_of(Rgb c) noexcept { return {c.r, c.g, c.b}; }
template <std::size_t N>
Channels<Floats<N>> channels_of(Vec3s<N> c) {
  return {c.x, c.y, c.z};
}
inline float sum_of(Rgb c) noexcept { return c.r + c.g + c.b; }
template <std::size_t N>
Floats<N> sum_of(Vec3s<N> c) {
  return c.x + c.y + c.z;
}

/// Applies f to each channel; a number is one channel.
template <typename F, typename Function>
F each_channel(F channel, Function&& f) {
  return f(channel);
}
template <typename Function>
Rgb each_channel(Rgb c, Function&& f) {
  return {f(c.r), f(c.g), f(c.b)};
}
template <std::size_t N, typename Function>
Vec3s<N> each_channel(Vec3s<N> c, Function&& f) {
  return {f(c.x), f(c.y), f(c.z)};
}
template <typename C>
C magnitudes(C c) noexcept {
  return each_channel(c, [](auto x) { return abs(x); });
}

}  // namespace core
