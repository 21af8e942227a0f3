/// MovedVertices: vertex positions of a mesh while the shutter is open.
#pragma once

#include <vector>

#include "core/math/vec.h"

namespace core {

/// Positions at one time after the opening. Normals: the same number, or none if the mesh has none.
struct MovedVertices {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;
};

}  // namespace core
