/// Which of several meshes form a closed surface together.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/geometry/mesh.h"

namespace core {

/// Meshes that share borders, or one mesh without a border.
struct JoinedSurface {
  std::vector<std::size_t> meshes;  ///< indices, ascending
  std::size_t border_edges = 0;     ///< of one triangle only, or passed one way; 0: closed
  std::size_t one_way_edges = 0;    ///< of these, those that two triangles pass in one direction
  double volume_m3 = 0;             ///< enclosed, if closed; negative if it faces inwards
};

/// Vertices closer than a few roundings of the largest coordinate are one. Triangles are on both
/// sides of an edge if they pass along it in opposite directions as often.
std::vector<JoinedSurface> join_surfaces(std::span<const MeshData* const> meshes);

}  // namespace core
