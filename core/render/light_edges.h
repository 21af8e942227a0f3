/// Where the film's filter straddles the rim of something that shines: found by rays that look for nothing else.
///
/// A few rays a pixel tell where the brightness of lights changes within the reach of the filter; there, a grid of rays gives the
/// integral of the filter times what is seen. Nothing of it goes into the picture; it is the same whenever the job runs.
#pragma once

#include <functional>
#include <stop_token>

#include "core/film/filter.h"
#include "core/film/light_edges.h"
#include "core/render/settings.h"

namespace core {

/// What is directly seen of lights at one place of the film.
struct SeenLight {
  Vec2 film_px;
  Rgb radiance;
};

/// Looks at place i of side * side ones, jittered, of the pixel (x, y), which may be outside of the film by the filter's radius.
using LightViewer = std::function<SeenLight(int x, int y, int i, int side)>;

/// At most a 32nd of the pixels and a few thousand, those of the strongest contrast. side: of the places of a pixel that tell where there
/// are rims, at most; large films get fewer. Empty when stop was requested.
LightEdges find_light_edges(const PixelRect& crop, const FilterSampler& filter, const LightViewer& look, int side,
                            const std::stop_token& stop);

}  // namespace core
