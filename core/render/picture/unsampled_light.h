/// Light that path tracing finds by chance alone, and how much of it one path can carry.
#pragma once

#include "core/render/picture/view.h"

namespace core {

/// Returns the largest irradiance (luminance) that a single path of a meter point can carry by
/// hitting an emitter or the environment through polished surfaces, where light sampling reaches
/// none: pi times the largest radiance, since a path's throughput is at most 1. 0 if no surface is
/// polished. Punctual lights are not included: no path hits them.
double unsampled_path_light(const View& view);

}  // namespace core
