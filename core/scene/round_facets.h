/// Facets whose rays may leave from the smooth surface that their normals imply, instead of the
/// facet itself (SurfacePoint::bulge_m), which hides the facets' own horizons.
///
/// The smooth surface is only believed of a small turn, and only where nothing stands on or beside
/// the facet: a ray that starts above it would pass through what is there. Bodies with averaged
/// normals, such as boxes, are drawn as the facets that they are.
#pragma once

#include <stop_token>

#include "core/base/result.h"
#include "core/scene/scene_data.h"

namespace core {

/// Fills MeshData::round_sides. Pre: scene.placed, instances and accel are complete. Errors:
/// kCancelled.
Status find_round_facets(SceneData& scene, const std::stop_token& stop);

}  // namespace core
