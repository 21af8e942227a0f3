/// Which of several meshes form a closed surface together.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/geometry/mesh.h"

namespace core {

/// Returns twice the area of a mesh.
double area(const MeshData& mesh);

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

/// Meshes whose borders close a surface together: at each edge there are two of them.
struct ClosingMeshes {
  std::vector<std::size_t> meshes;  ///< indices, ascending
  std::vector<bool> is_turned;      ///< of each: is wound the other way than the first
};

/// Vertices are one as for join_surfaces(). Meshes without a border, and surfaces with one side
/// only, are left out.
std::vector<ClosingMeshes> find_closing_meshes(std::span<const MeshData* const> meshes);

}  // namespace core
