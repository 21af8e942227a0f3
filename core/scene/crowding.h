/// Tells scenes whose geometry is crowded into one place, where a ray has to be tested against all
/// of it.
#pragma once

#include <string>

#include "core/scene/scene_data.h"

namespace core {

/// Returns the mean number of boxes of triangles and instances that a line through the scene's box
/// meets: the sum of their areas over that of the scene's box. The triangles of an instance are
/// counted in its own frame. Source: the surface area heuristic; MacDonald and Booth 1990,
/// Heuristics for Ray Tracing Using Space Subdivision.
double boxes_met(const SceneData& scene);

/// Scenes above this are warned about. A test of a box or triangle takes about 10 ns, so a ray then
/// takes 10 us; it takes about 1 us in a scene of a million spread triangles.
inline constexpr double kBoxesMetMost = 1000;
std::string crowding_warning(double boxes_met);

}  // namespace core
