/// FewTriangles: intersects packets of eight rays with a few dozen triangles, one after another,
/// which costs less than a tree. Two triangles that form a parallelogram are intersected as one.
///
/// A ray is intersected with the plane first; the barycentric coordinates of that point are then
/// two linear functions of it, about a vertex. Source: Havel and Herout, Yet Faster Ray-Triangle
/// Intersection, IEEE TVCG 16(3), 2010. The difference of a ray's origin and a vertex is exact up
/// to a rounding, so a ray that starts off a triangle by offset_ray() does not hit it.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/accel/accel.h"

namespace core {

class FewTriangles {
 public:
  /// Eight rays take some 60 instructions per triangle or parallelogram, so a ray takes at most
  /// 480, while Embree's packets take 910 in a box of 36 triangles (callgrind, cornell-box).
  static constexpr std::size_t kMost = 64;

  /// Stores the triangles of the top level, or none if there are more than kMost or one is a
  /// sliver.
  explicit FewTriangles(std::span<const AccelGeometry> top_level);

  bool empty() const noexcept { return shapes_.empty(); }
  /// As Accel::intersect8() and occluded8(); empty if a ray starts too far away. A ray that is not
  /// finite hits nothing.
  std::optional<unsigned> intersect8(const RayPacket& rays, unsigned active,
                                     HitPacket& hits) const noexcept;
  std::optional<unsigned> occluded8(const RayPacket& rays, unsigned active) const noexcept;

 private:
  /// A triangle, or the parallelogram of which it is one half.
  struct Shape {
    Vec3 corner;          ///< the first vertex, about which the others are
    Vec3 normal;          ///< as long as twice the area
    Vec3 barycentric[2];  ///< gradients of the coordinates of the second and third vertex
    float slack[3] = {};  ///< see cross()
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
  float reach_most_m_ = std::numeric_limits<float>::infinity();
  Vec3 center_;
  std::vector<Shape> shapes_;  ///< parallelograms first
  std::size_t parallelograms_ = 0;
  std::vector<std::array<Name, 2>> names_;  ///< of a shape's half, and of the opposite one
};

}  // namespace core
