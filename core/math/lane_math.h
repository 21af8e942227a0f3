/// Geometry in SIMD lanes: the functions of core/math and core/sampling that paths need, N at a
/// time.
///
/// Each follows its scalar counterpart step by step, so results agree up to rounding.
#pragma once

#include <limits>

#include "core/math/lanes.h"
#include "core/math/numbers.h"
#include "core/math/vec.h"

namespace core {

template <std::size_t N>
struct Vec3s {
  Floats<N> x, y, z;

  Vec3s() = default;
  Vec3s(Floats<N> a, Floats<N> b, Floats<N> c) : x(a), y(b), z(c) {}
  explicit Vec3s(Vec3 v) : x(v.x), y(v.y), z(v.z) {}
  explicit Vec3s(Floats<N> grey) : x(grey), y(grey), z(grey) {}
  friend Vec3s operator+(Vec3s a, Vec3s b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend Vec3s operator-(Vec3s a, Vec3s b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend Vec3s operator*(Vec3s a, Vec3s b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
  friend Vec3s operator*(Vec3s a, Floats<N> s) { return {a.x * s, a.y * s, a.z * s}; }
  friend Vec3s operator-(Vec3s a) { return {-a.x, -a.y, -a.z}; }
  Vec3 lane(std::size_t k) const { return {x.v[k], y.v[k], z.v[k]}; }
  void set(std::size_t k, Vec3 value) {
    x.v[k] = value.x;
    y.v[k] = value.y;
    z.v[k] = value.z;
  }
};

template <std::size_t N>
struct Vec2s {
  Floats<N> x, y;

  friend Vec2s operator+(Vec2s a, Vec2s b) { return {a.x + b.x, a.y + b.y}; }
  friend Vec2s operator-(Vec2s a, Vec2s b) { return {a.x - b.x, a.y - b.y}; }
  friend Vec2s operator*(Vec2s a, Floats<N> s) { return {a.x * s, a.y * s}; }
};
template <std::size_t N>
struct Vec4s {
  Floats<N> x, y, z, w;
};

template <std::size_t N>
Floats<N> dot(Vec3s<N> a, Vec3s<N> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <std::size_t N>
Vec3s<N> cross(Vec3s<N> a, Vec3s<N> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <std::size_t N>
Vec3s<N> select(Mask<N> mask, Vec3s<N> yes, Vec3s<N> no) {
  return {select(mask, yes.x, no.x), select(mask, yes.y, no.y), select(mask, yes.z, no.z)};
}
template <std::size_t N>
Floats<N> length(Vec3s<N> a) {
  return sqrt(dot(a, a));
}
template <std::size_t N>
Vec3s<N> normalize(Vec3s<N> a) {
  return a * (Floats<N>(1) / length(a));
}
template <std::size_t N>
Vec3s<N> normalize_or(Vec3s<N> a, Vec3s<N> otherwise) {
  const Floats<N> squared = dot(a, a);
  const Mask<N> usable =
      (squared >= Floats<N>(std::numeric_limits<float>::min())) & is_finite(squared);
  return select(usable, a * (Floats<N>(1) / sqrt(squared)), otherwise);
}
template <std::size_t N>
Floats<N> max_component(Vec3s<N> a) {
  return max(a.x, max(a.y, a.z));
}
template <std::size_t N>
Floats<N> clamp01(Floats<N> x) {
  return min(max(x, Floats<N>(0)), Floats<N>(1));
}
template <std::size_t N>
Floats<N> square(Floats<N> x) {
  return x * x;
}

/// Returns sine and cosine for |x| <= 2 pi. Source: Moshier's Cephes library, sinf and cosf; errors
/// below 2e-7.
template <std::size_t N>
void sincos(Floats<N> x, Floats<N>& sine, Floats<N>& cosine) {
  constexpr float kHalfPi = 1.57079637F;         // the float nearest to pi / 2,
  constexpr float kHalfPiRest = 4.37113883e-8F;  // and its excess over pi / 2
  constexpr float kRound = 0x1.8p23F;            // adding it rounds to an integer
  const Floats<N> shifted = x * Floats<N>(1 / kHalfPi) + Floats<N>(kRound);
  const Ints<N> quarter = bits_of(shifted);
  const Floats<N> q = shifted - Floats<N>(kRound);
  const Floats<N> r = x - q * Floats<N>(kHalfPi) + q * Floats<N>(kHalfPiRest);
  const Floats<N> r2 = r * r;
  const Floats<N> s =
      r + r * r2 *
              (Floats<N>(-1.6666654611e-1F) +
               r2 * (Floats<N>(8.3321608736e-3F) + r2 * Floats<N>(-1.9515295891e-4F)));
  const Floats<N> c =
      Floats<N>(1) + r2 * (Floats<N>(-0.5F) + r2 * (Floats<N>(4.166664568298827e-2F) +
                                                    r2 * (Floats<N>(-1.388731625493765e-3F) +
                                                          r2 * Floats<N>(2.443315711809948e-5F))));
  const Mask<N> swap = ~((quarter & Ints<N>(1)) == Ints<N>(0));
  const auto negated = [](Floats<N> value, Ints<N> where) {  // bit 1 of `where` becomes the sign
    return floats_of(Ints<N>(bits_of(value).v ^ ((where & Ints<N>(2)).v << 30)));
  };
  sine = negated(select(swap, c, s), quarter);
  cosine = negated(select(swap, s, c), quarter + Ints<N>(1));
}

/// As std::atan2; 0 at the origin. Source: Moshier's Cephes library, atanf; errors below 4e-7.
template <std::size_t N>
Floats<N> atan2(Floats<N> y, Floats<N> x) {
  const Floats<N> zero(0);
  const Floats<N> one(1);
  const Floats<N> ax = abs(x);
  const Floats<N> ay = abs(y);
  const Floats<N> large = max(ax, ay);
  const Floats<N> ratio = select(large > zero, min(ax, ay) / large, zero);
  const Mask<N> wide = ratio > Floats<N>(0.414213562F);  // tan(pi / 8)
  const Floats<N> a = select(wide, (ratio - one) / (ratio + one), ratio);
  const Floats<N> a2 = a * a;
  const Floats<N> series =
      a + a * a2 *
              (Floats<N>(-3.33329491539e-1F) +
               a2 * (Floats<N>(1.99777106478e-1F) +
                     a2 * (Floats<N>(-1.38776856032e-1F) + a2 * Floats<N>(8.05374449538e-2F))));
  Floats<N> angle = select(wide, Floats<N>(kPi / 4) + series, series);
  angle = select(ay > ax, Floats<N>(kPi / 2) - angle, angle);
  angle = select(x < zero, Floats<N>(kPi) - angle, angle);
  return select(y < zero, -angle, angle);
}

/// Pre: x positive and normal. Source: Moshier's Cephes library, log2f; errors below 3e-7 of
/// 1 + |log2(x)|.
template <std::size_t N>
Floats<N> log2(Floats<N> x) {
  constexpr std::int32_t kSqrtHalf = 0x3f3504f3;  // bits of sqrt(1/2)
  const Ints<N> above = bits_of(x) - Ints<N>(kSqrtHalf);
  const Ints<N> exponent = Ints<N>(above.v >> 23);
  const Floats<N> f =
      floats_of(Ints<N>((above.v & 0x7fffff) + kSqrtHalf)) - Floats<N>(1);  // in [-0.29, 0.41]
  const Floats<N> f2 = f * f;
  Floats<N> series(7.0376836292e-2F);
  for (const float c : {-1.1514610310e-1F, 1.1676998740e-1F, -1.2420140846e-1F, 1.4249322787e-1F,
                        -1.6668057665e-1F, 2.0000714765e-1F, -2.4999993993e-1F, 3.3333331174e-1F}) {
    series = series * f + Floats<N>(c);
  }
  const Floats<N> natural = f + (f * f2 * series - Floats<N>(0.5F) * f2);
  return to_floats(exponent) + natural * Floats<N>(1.44269504F);
}
/// As std::floor. Pre: |x| < 2^31.
template <std::size_t N>
Ints<N> floor_of(Floats<N> x) {
  const Ints<N> towards_zero = truncated(x);
  return select(x < to_floats(towards_zero), towards_zero - Ints<N>(1), towards_zero);
}
/// Returns at least 2^-126. Pre: x < 127.5. Source: Moshier's Cephes library, exp2f; relative
/// errors below 2e-7.
template <std::size_t N>
Floats<N> exp2(Floats<N> x) {
  const Floats<N> above = max(x, Floats<N>(-126));
  const Ints<N> whole = floor_of(above + Floats<N>(0.5F));
  const Floats<N> f = above - to_floats(whole);  // in [-0.5, 0.5]
  Floats<N> series(1.535336188319500e-4F);
  for (const float c : {1.339887440266574e-3F, 9.618437357674640e-3F, 5.550332471162809e-2F,
                        2.402264791363012e-1F, 6.931472028550421e-1F, 1.0F}) {
    series = series * f + Floats<N>(c);
  }
  return series * floats_of(Ints<N>((whole.v + 127) << 23));
}
/// Relative errors below 1e-7 (2 + |x|). Pre: x < 88.
template <std::size_t N>
Floats<N> exp(Floats<N> x) {
  return exp2(x * Floats<N>(1.44269504F));
}
/// Pre: x >= 0, and the result is below 2^127. Returns at least 2^-126.
template <std::size_t N>
Floats<N> pow(Floats<N> x, Floats<N> power) {
  return exp2(power * log2(max(x, Floats<N>(std::numeric_limits<float>::min()))));
}
/// Clamps i to [0, count).
template <std::size_t N>
Ints<N> within(Ints<N> i, Ints<N> count) {
  const Ints<N> last = count - Ints<N>(1);
  const Ints<N> low = select(i < Ints<N>(0), Ints<N>(0), i);
  return select(last < low, last, low);
}

}  // namespace core
