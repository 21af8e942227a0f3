/// Rgb: linear Rec.709 (sRGB primaries, D65). Radiance is in W/(m^2 sr) per channel.
#pragma once

#include <algorithm>
#include <cmath>

namespace core {

struct Rgb {
  float r = 0;
  float g = 0;
  float b = 0;

  constexpr Rgb() = default;
  constexpr Rgb(float red, float green, float blue) noexcept : r(red), g(green), b(blue) {}
  explicit constexpr Rgb(float grey) noexcept : r(grey), g(grey), b(grey) {}

  constexpr float operator[](int i) const noexcept { return i == 0 ? r : (i == 1 ? g : b); }
};

constexpr Rgb operator+(Rgb a, Rgb c) noexcept { return {a.r + c.r, a.g + c.g, a.b + c.b}; }
constexpr Rgb operator-(Rgb a, Rgb c) noexcept { return {a.r - c.r, a.g - c.g, a.b - c.b}; }
constexpr Rgb operator*(Rgb a, Rgb c) noexcept { return {a.r * c.r, a.g * c.g, a.b * c.b}; }
constexpr Rgb operator*(Rgb a, float s) noexcept { return {a.r * s, a.g * s, a.b * s}; }
constexpr Rgb operator*(float s, Rgb a) noexcept { return a * s; }
constexpr Rgb operator/(Rgb a, float s) noexcept { return a * (1.0F / s); }
constexpr Rgb& operator+=(Rgb& a, Rgb c) noexcept { return a = a + c; }
constexpr Rgb& operator*=(Rgb& a, Rgb c) noexcept { return a = a * c; }
constexpr Rgb& operator*=(Rgb& a, float s) noexcept { return a = a * s; }
constexpr bool operator==(Rgb a, Rgb c) noexcept { return a.r == c.r && a.g == c.g && a.b == c.b; }

/// Rec.709 luminance, the Y of CIE XYZ.
constexpr float luminance(Rgb c) noexcept { return 0.2126F * c.r + 0.7152F * c.g + 0.0722F * c.b; }
constexpr float max_component(Rgb c) noexcept { return std::max(c.r, std::max(c.g, c.b)); }
constexpr float average(Rgb c) noexcept { return (c.r + c.g + c.b) * (1.0F / 3.0F); }
constexpr bool is_black(Rgb c) noexcept { return c.r == 0 && c.g == 0 && c.b == 0; }
constexpr Rgb lerp(Rgb a, Rgb c, float t) noexcept { return a * (1 - t) + c * t; }
inline bool is_finite(Rgb c) noexcept {
  return std::isfinite(c.r) && std::isfinite(c.g) && std::isfinite(c.b);
}

}  // namespace core
