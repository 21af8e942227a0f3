/// Finds the solids of a scene, and the solids around a point.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/description/scene_description.h"
#include "core/media/medium_stack.h"
#include "core/scene/scene_data.h"

namespace core {

/// Returns whether two boxes overlap; boxes that touch do.
constexpr bool overlap(const Bounds& a, const Bounds& b) noexcept {
  return a.min.x <= b.max.x && b.min.x <= a.max.x && a.min.y <= b.max.y && b.min.y <= a.max.y &&
         a.min.z <= b.max.z && b.min.z <= a.max.z;
}

/// Returns the distance of `other` from the plane of `point`. Two faces coincide if it is not more
/// than the sum of their errors.
inline float apart_m(const SurfacePoint& point, const SurfacePoint& other) noexcept {
  return std::fabs(dot(other.position - point.position, point.normal_geometric));
}

/// What the meshes of a scene come from.
struct PlacedFrom {
  SceneDescription& description;
  /// Of each placed mesh; those of an instance follow each other.
  std::span<const InstanceDescription* const> instances;
  std::size_t top_level;  ///< number of placed meshes in world space, which are the first
  std::vector<std::vector<std::uint32_t>> pieces = {};  ///< from turn_pieces()
};

/// Fills scene.solids, PlacedMesh::solid and the members that follow from them. The meshes of one
/// instance, or of several that close a surface together, are one solid if they share borders; its
/// medium is that of the largest. Ranks: by the priority of the material; else the smaller solid
/// wins (by its box), which is the inner one where solids nest; open surfaces, which may extend
/// without limit, are the largest. Warns, in the description, of surfaces that are not closed or
/// that face inwards.
void find_solids(SceneData& scene, const PlacedFrom& from);

/// Returns the solids around a point. Source: crossings of rays from there with closed surfaces,
/// the median of several directions, so that a ray along an edge does not count; an open surface
/// contains the points from which most rays that opaque surfaces do not stop meet its back first.
MediumStack solids_around(const SceneData& scene, Vec3 point, float time = 0) noexcept;

}  // namespace core
