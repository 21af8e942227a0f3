/// Builds the data of a scene from its description.
#pragma once

#include <cstddef>
#include <stop_token>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/description/scene_description.h"
#include "core/math/bounds.h"
#include "core/scene/scene_data.h"

namespace core {

/// The geometry of all instances.
struct PlacedGeometry {
  Bounds bounds;
  std::vector<Vec3> extremes;  ///< SceneSummary::extremes
  std::size_t triangles = 0;
};

/// Moves the meshes out of `from`. Errors: as Scene::build().
Result<PlacedGeometry> build_scene_data(SceneDescription& from, SceneData& to, int threads,
                                        std::string_view isa, const std::stop_token& stop);

}  // namespace core
