/// Rgb: linear Rec.709 (sRGB primaries, D65). Radiance is in W/(m^2 sr) per channel.
#pragma once

#include <algorithm>
#include <array>
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

/// Weights of red, green and blue in Rec.709 luminance, the Y of CIE XYZ. Source: IEC 61966-2-1.
template <typename F>
inline constexpr std::array<F, 3> kLuminance = {F(0.2126), F(0.7152), F(0.0722)};

constexpr float luminance(Rgb c) noexcept {
  return kLuminance<float>[0] * c.r + kLuminance<float>[1] * c.g + kLuminance<float>[2] * c.b;
}

/// Linear Rec.709 of CIE XYZ. F: type of number; Color: made of three of them. Source: the inverse
/// of IEC 61966-2-1.
template <typename Color = Rgb, typename F = float>
constexpr Color rgb_from_xyz(F x, F y, F z) noexcept {
  return {F(3.2404542) * x - F(1.5371385) * y - F(0.4985314) * z,
          F(-0.9692660) * x + F(1.8760108) * y + F(0.0415560) * z,
          F(0.0556434) * x - F(0.2040259) * y + F(1.0572252) * z};
}
constexpr float max_component(Rgb c) noexcept { return std::max(c.r, std::max(c.g, c.b)); }
constexpr float average(Rgb c) noexcept { return (c.r + c.g + c.b) * (1.0F / 3.0F); }
constexpr bool is_black(Rgb c) noexcept { return c.r == 0 && c.g == 0 && c.b == 0; }
constexpr Rgb lerp(Rgb a, Rgb c, float t) noexcept { return a * (1 - t) + c * t; }
inline bool is_finite(Rgb c) noexcept {
  return std::isfinite(c.r) && std::isfinite(c.g) && std::isfinite(c.b);
}

}  // namespace core
