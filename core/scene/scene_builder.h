/// Turns a description into the data of a scene.
#pragma once

#include <cstddef>
#include <string_view>

#include "core/base/result.h"
#include "core/description/scene_description.h"
#include "core/math/bounds.h"
#include "core/scene/scene_data.h"

namespace core {

/// All instances together.
struct PlacedGeometry {
  Bounds bounds;
  std::size_t triangles = 0;
};

/// Moves the meshes out of `from`. Errors: those of Scene::build().
Result<PlacedGeometry> build_scene_data(SceneDescription& from, SceneData& to, int threads,
                                        std::string_view isa);

}  // namespace core
