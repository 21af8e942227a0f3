/// Numbers used by light transport, and ends of formats of numbers.
#pragma once

#include <algorithm>
#include <cmath>

namespace core {

inline constexpr float kPi = 3.14159265358979F;
inline constexpr float kInvPi = 0.318309886183791F;
inline constexpr float kTwoPi = 6.28318530717959F;
/// The largest float below 1.
inline constexpr float kOneMinusEpsilon = 0x1.fffffep-1F;
/// The largest float16 (IEEE 754).
inline constexpr float kHalfMax = 65504;
/// Half floats have 11 bits from here on, and fewer below: IEEE 754 binary16.
inline constexpr float kHalfNormalMin = 0x1p-14F;
/// A double holds all whole numbers up to this one.
inline constexpr double kExactIntegers = 0x1p53;

constexpr float square(float x) noexcept { return x * x; }
inline float safe_sqrt(float x) noexcept { return std::sqrt(std::max(x, 0.0F)); }
constexpr float clamp01(float x) noexcept { return x < 0 ? 0.0F : (x > 1 ? 1.0F : x); }
constexpr float lerp(float a, float b, float t) noexcept { return a + (b - a) * t; }

}  // namespace core
