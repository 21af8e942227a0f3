/// Vec2, Vec3, Vec4: three floats and the arithmetic a renderer needs.
#pragma once

#include <cmath>
#include <limits>

namespace core {

struct Vec2 {
  float x = 0;
  float y = 0;
};

struct Vec3 {
  float x = 0;
  float y = 0;
  float z = 0;

  constexpr float operator[](int i) const noexcept { return i == 0 ? x : (i == 1 ? y : z); }
};

struct Vec4 {
  float x = 0;
  float y = 0;
  float z = 0;
  float w = 0;
};

constexpr Vec2 operator+(Vec2 a, Vec2 b) noexcept { return {a.x + b.x, a.y + b.y}; }
constexpr Vec2 operator-(Vec2 a, Vec2 b) noexcept { return {a.x - b.x, a.y - b.y}; }
constexpr Vec2 operator*(Vec2 a, float s) noexcept { return {a.x * s, a.y * s}; }
constexpr Vec2 operator*(float s, Vec2 a) noexcept { return a * s; }

constexpr Vec3 operator+(Vec3 a, Vec3 b) noexcept { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
constexpr Vec3 operator-(Vec3 a, Vec3 b) noexcept { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
constexpr Vec3 operator-(Vec3 a) noexcept { return {-a.x, -a.y, -a.z}; }
constexpr Vec3 operator*(Vec3 a, float s) noexcept { return {a.x * s, a.y * s, a.z * s}; }
constexpr Vec3 operator*(float s, Vec3 a) noexcept { return a * s; }
constexpr Vec3 operator*(Vec3 a, Vec3 b) noexcept { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
constexpr Vec3 operator/(Vec3 a, float s) noexcept { return {a.x / s, a.y / s, a.z / s}; }
constexpr Vec3& operator+=(Vec3& a, Vec3 b) noexcept { return a = a + b; }

constexpr Vec4 operator+(Vec4 a, Vec4 b) noexcept {
  return {a.x + b.x, a.y + b.y, a.z + b.z, a.w + b.w};
}
constexpr Vec4 operator*(Vec4 a, float s) noexcept { return {a.x * s, a.y * s, a.z * s, a.w * s}; }

constexpr bool operator==(Vec2 a, Vec2 b) noexcept { return a.x == b.x && a.y == b.y; }
constexpr bool operator==(Vec3 a, Vec3 b) noexcept {
  return a.x == b.x && a.y == b.y && a.z == b.z;
}

constexpr float dot(Vec2 a, Vec2 b) noexcept { return a.x * b.x + a.y * b.y; }
constexpr float dot(Vec3 a, Vec3 b) noexcept { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 cross(Vec3 a, Vec3 b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
constexpr float length_squared(Vec3 a) noexcept { return dot(a, a); }
inline float length(Vec3 a) noexcept { return std::sqrt(dot(a, a)); }

/// Pre: a is not zero.
inline Vec3 normalize(Vec3 a) noexcept { return a * (1.0F / length(a)); }

/// Returns the unit vector of a, or `otherwise` if the length of a is unusable.
inline Vec3 normalize_or(Vec3 a, Vec3 otherwise) noexcept {
  const float squared = dot(a, a);
  return squared >= std::numeric_limits<float>::min() && std::isfinite(squared)
             ? a * (1.0F / std::sqrt(squared))
             : otherwise;
}

inline bool is_finite(Vec3 a) noexcept {
  return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

constexpr float max_component(Vec3 a) noexcept {
  const float xy = a.x > a.y ? a.x : a.y;
  return xy > a.z ? xy : a.z;
}

}  // namespace core
