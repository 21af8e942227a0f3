/// Packets of eight rays against a few dozen triangles, one after another: below what a tree costs.
/// Two that make a parallelogram are met as one.
///
/// A ray meets the plane first; the barycentric coordinates of that point then are two affine
/// functions of it. Source: Havel and Herout, Yet Faster Ray-Triangle Intersection, IEEE TVCG
/// 16(3), 2010.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "core/accel/accel.h"

namespace core {

class FewTriangles {
 public:
  /// Eight rays take some 60 instructions for a triangle or a parallelogram, so a ray takes at most
  /// 480, where Embree's packets take 910 in a box of 36 triangles (callgrind, cornell-box).
  static constexpr std::size_t kMost = 64;

  /// Of the top level; without triangles where it has more than kMost.
  explicit FewTriangles(std::span<const AccelGeometry> top_level);

  bool empty() const noexcept { return shapes_.empty(); }
  /// Accel::intersect8() and occluded8(). A ray that is not finite meets nothing.
  unsigned intersect8(const RayPacket& rays, unsigned active, HitPacket& hits) const noexcept;
  unsigned occluded8(const RayPacket& rays, unsigned active) const noexcept;

 private:
  /// About center_: value = dot(at, point) + beside.
  struct Affine {
    Vec3 at;
    float beside = 0;
  };
  /// A triangle, or the parallelogram of which it is one half.
  struct Shape {
    Affine plane;           ///< of the distance in lengths of the normal
    Affine barycentric[2];  ///< of the second and third corner
    float slack[3] = {};    ///< see cross()
  };
  struct Name {
    std::uint32_t geometry;
    std::uint32_t primitive;
  };
  struct Corners;
  struct Rays;
  static Shape shape_of(const Vec3 (&corner)[3]);
  bool pair_up(std::vector<Corners>& triangles);
  struct Crossing;
  template <bool kIsWhole>
  static Crossing cross(const Shape& shape, const Rays& rays) noexcept;

  float radius_m_ = 0;
  Vec3 center_;
  std::vector<Shape> shapes_;  ///< parallelograms first
  std::size_t parallelograms_ = 0;
  std::vector<std::array<Name, 2>> names_;  ///< of a shape's half, and of the one opposite
};

}  // namespace core
