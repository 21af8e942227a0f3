/// MovedVertices: where a mesh is while the shutter is open.
#pragma once

#include <vector>

#include "core/math/vec.h"

namespace core {

/// At one of the times after the opening. Normals: as many, or none where the mesh has none.
struct MovedVertices {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;
};

}  // namespace core
