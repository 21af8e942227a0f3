/// Rays against a few dozen triangles, eight at a time: below what a tree costs.
///
/// The side of a ray on which an edge runs is the permuted inner product of their Plücker
/// coordinates. Those of an edge that two triangles share differ in sign alone, exactly, so no ray
/// passes between the two. Source: Shoemake, Plücker Coordinate Tutorial, Ray Tracing News 11(1),
/// 1998; Davidovic et al., 3D Rasterization II, 2011.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/accel/accel.h"

namespace core {

class FewTriangles {
 public:
  /// A ray takes some 58 instructions for eight triangles and 120 beside them, so at most 600,
  /// where Embree's packets take 910 in a box of 36 triangles (callgrind, cornell-box).
  static constexpr std::size_t kMost = 64;

  /// Of the top level; without triangles where it has more than kMost.
  explicit FewTriangles(std::span<const AccelGeometry> top_level);

  bool empty() const noexcept { return groups_.empty(); }
  /// Nearest hit in (0, t_max]. A ray that is not finite meets nothing.
  bool intersect(const Ray& ray, RawHit& hit) const noexcept;
  bool occluded(const Ray& ray) const noexcept;

 private:
  /// [axis][triangle]; about center_.
  struct alignas(32) Group {
    float edge[3][3][8];    ///< [which]: from corner to corner
    float moment[3][3][8];  ///< cross product of the edge's ends
    float normal[3][8];
    float offset[8];  ///< normal dot corner
  };
  struct Name {
    std::uint32_t geometry;
    std::uint32_t primitive;
  };
  struct RayLanes;
  struct Crossing;
  static Crossing cross(const Group& group, const RayLanes& ray) noexcept;

  Vec3 center_;
  std::vector<Group> groups_;
  std::vector<Name> names_;
};

}  // namespace core
