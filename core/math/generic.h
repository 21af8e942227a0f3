/// Formulas that are written once, for one path and for lanes.
///
/// Such a formula is a template of its number F: float, or Floats<N> for N paths at once. The types
/// that go with F are Vec3Of<F> and the like; masks of floats are bools. Floats have the functions
/// of lanes here, so that the same text compiles for both.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "core/math/lane_math.h"
#include "core/math/numbers.h"
#include "core/math/vec.h"

namespace core {

template <typename F>
struct Of;
template <>
struct Of<float> {
  using Mask = bool;
  using Int = int;
  using Pair = Vec2;
  using Vec = Vec3;
};
template <std::size_t N>
struct Of<Floats<N>> {
  using Mask = core::Mask<N>;
  using Int = Ints<N>;
  using Pair = Vec2s<N>;
  using Vec = Vec3s<N>;
};
template <typename F>
using MaskOf = typename Of<F>::Mask;
template <typename F>
using IntOf = typename Of<F>::Int;
template <typename F>
using Vec2Of = typename Of<F>::Pair;
template <typename F>
using Vec3Of = typename Of<F>::Vec;

inline bool any(bool mask) noexcept { return mask; }
inline bool all(bool mask) noexcept { return mask; }
inline bool opposite(bool mask) noexcept { return !mask; }
template <std::size_t N>
bool any(Mask<N> mask) {
  return mask.any();
}
template <std::size_t N>
bool all(Mask<N> mask) {
  return mask.all();
}
template <std::size_t N>
Mask<N> opposite(Mask<N> mask) {
  return ~mask;
}

inline int select(bool mask, int yes, int no) noexcept { return mask ? yes : no; }
inline float select(bool mask, float yes, float no) noexcept { return mask ? yes : no; }
inline Vec3 select(bool mask, Vec3 yes, Vec3 no) noexcept { return mask ? yes : no; }
inline float min(float a, float b) noexcept { return a < b ? a : b; }
inline float max(float a, float b) noexcept { return a > b ? a : b; }
inline float sqrt(float x) noexcept { return std::sqrt(x); }
inline float abs(float x) noexcept { return std::fabs(x); }
inline float hypot(float x, float y) noexcept { return std::hypot(x, y); }
template <std::size_t N>
Floats<N> hypot(Floats<N> x, Floats<N> y) {
  return sqrt(x * x + y * y);
}
inline float atan2(float y, float x) noexcept { return std::atan2(y, x); }
inline void sincos(float x, float& sine, float& cosine) noexcept {
  sine = std::sin(x);
  cosine = std::cos(x);
}
/// Returns 1 with the sign of x.
inline float sign_of(float x) noexcept { return std::copysign(1.0F, x); }
template <std::size_t N>
Floats<N> sign_of(Floats<N> x) {
  return floats_of((bits_of(x) & Ints<N>(std::int32_t(0x80000000U))) | bits_of(Floats<N>(1)));
}
inline float exp(float x) noexcept { return std::exp(x); }
inline float log(float x) noexcept { return std::log(x); }
template <std::size_t N>
Floats<N> log(Floats<N> x) {
  return log2(x) * Floats<N>(0.693147181F);
}
inline float log2(float x) noexcept { return std::log2(x); }
inline float pow(float x, float power) noexcept { return std::pow(x, power); }
inline int truncated(float x) noexcept { return static_cast<int>(x); }
inline float to_floats(int x) noexcept { return static_cast<float>(x); }
constexpr float to_floats(std::uint32_t x) noexcept { return static_cast<float>(x); }
/// Pre: |x| < 2^31.
inline int floor_of(float x) noexcept { return static_cast<int>(std::floor(x)); }
inline int bits_of(float x) noexcept { return std::bit_cast<int>(x); }
inline float floats_of(int x) noexcept { return std::bit_cast<float>(x); }
/// Clamps i to [0, count).
inline int within(int i, int count) noexcept { return std::clamp(i, 0, count - 1); }

template <typename T>
T gather(const T* p, int index) noexcept {
  return p[index];
}

/// Loads the four floats at base + at, per lane.
inline void load_four(const float* base, int at, float (&out)[4]) noexcept {
  for (int k = 0; k < 4; ++k) {
    out[k] = base[at + k];
  }
}
template <std::size_t N>
void load_four(const float* base, Ints<N> at, Floats<N> (&out)[4]) {
  alignas(32) std::int32_t offset[N];
  store(offset, at);
  const float* rows[N];
  for (std::size_t k = 0; k < N; ++k) {
    rows[k] = base + offset[k];
  }
  transpose(rows, out);
}

}  // namespace core
