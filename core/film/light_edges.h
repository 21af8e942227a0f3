/// Pixels that see a light in part: at its rim, or all of it where it is smaller than the pixel. Rare samples meet it at the tail of
/// the film's filter, and neither the pixel's samples nor its neighbours say how rare; the scene does.
#pragma once

#include <cstdint>
#include <vector>

#include "core/color/rgb.h"

namespace core {

struct LightEdge {
  std::uint32_t pixel = 0;  ///< row by row over the film's crop
  Rgb mean;                 ///< expected radiance of what is directly seen of lights and sky
  float variance = 0;       ///< of the luminance of one sample of it
  float coverage = 0;       ///< share of the samples that see it
};

/// In increasing order of pixels.
using LightEdges = std::vector<LightEdge>;

}  // namespace core
