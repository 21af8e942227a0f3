/// Transform: an affine map with 3 rows of 4, p' = A p + t. Column vectors; right-handed, y up.
#pragma once

#include "core/math/vec.h"

namespace core {

struct Transform {
  /// Columns: images of the x, y and z axes, and the translation in metres.
  Vec3 x = {1, 0, 0};
  Vec3 y = {0, 1, 0};
  Vec3 z = {0, 0, 1};
  Vec3 t = {0, 0, 0};

  constexpr Vec3 point(Vec3 p) const noexcept { return x * p.x + y * p.y + z * p.z + t; }
  constexpr Vec3 vector(Vec3 v) const noexcept { return x * v.x + y * v.y + z * v.z; }
  /// Transforms a normal by the inverse transpose up to scale, computed from cofactors: mirrored
  /// maps keep the side (by the determinant's sign), and singular ones stay finite. Not normalised.
  constexpr Vec3 normal(Vec3 n) const noexcept {
    const Vec3 c = cross(y, z) * n.x + cross(z, x) * n.y + cross(x, y) * n.z;
    return determinant() < 0 ? -c : c;
  }
  constexpr float determinant() const noexcept { return dot(cross(x, y), z); }
};

/// Returns m.point(p) rounded once: far from the origin of either space the products nearly cancel.
constexpr Vec3 exact_point(const Transform& m, Vec3 p) noexcept {
  const auto sum = [p](float x, float y, float z, float t) {
    return static_cast<float>(static_cast<double>(x) * static_cast<double>(p.x) +
                              static_cast<double>(y) * static_cast<double>(p.y) +
                              static_cast<double>(z) * static_cast<double>(p.z) +
                              static_cast<double>(t));
  };
  return {sum(m.x.x, m.y.x, m.z.x, m.t.x), sum(m.x.y, m.y.y, m.z.y, m.t.y),
          sum(m.x.z, m.y.z, m.z.z, m.t.z)};
}

/// Applies b, then a: (a * b).point(p) == a.point(b.point(p)).
constexpr Transform operator*(const Transform& a, const Transform& b) noexcept {
  return {a.vector(b.x), a.vector(b.y), a.vector(b.z), a.point(b.t)};
}

/// Pre: determinant() != 0.
constexpr Transform inverse(const Transform& m) noexcept {
  const float d = 1.0F / m.determinant();
  const Vec3 r0 = cross(m.y, m.z) * d;
  const Vec3 r1 = cross(m.z, m.x) * d;
  const Vec3 r2 = cross(m.x, m.y) * d;
  Transform i;
  i.x = {r0.x, r1.x, r2.x};
  i.y = {r0.y, r1.y, r2.y};
  i.z = {r0.z, r1.z, r2.z};
  i.t = -i.vector(m.t);
  return i;
}

constexpr Transform translation(Vec3 t) noexcept { return {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, t}; }
constexpr Transform scaling(Vec3 s) noexcept {
  return {{s.x, 0, 0}, {0, s.y, 0}, {0, 0, s.z}, {0, 0, 0}};
}
/// Returns the rotation of a unit quaternion (x, y, z, w), as stored in glTF.
constexpr Transform rotation(Vec4 q) noexcept {
  return {
      {1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y + q.w * q.z), 2 * (q.x * q.z - q.w * q.y)},
      {2 * (q.x * q.y - q.w * q.z), 1 - 2 * (q.x * q.x + q.z * q.z), 2 * (q.y * q.z + q.w * q.x)},
      {2 * (q.x * q.z + q.w * q.y), 2 * (q.y * q.z - q.w * q.x), 1 - 2 * (q.x * q.x + q.y * q.y)},
      {0, 0, 0}};
}

}  // namespace core
