/// FrameMatch: where another image of a series shows the surfaces of this one.
#pragma once

#include <cstdint>
#include <vector>

namespace core {

struct FrameMatch {
  /// Per pixel, row by row: index of the pixel of the other image that shows the same point of a
  /// surface; -1: none does, because the point is hidden there, outside, or not on a surface.
  std::vector<std::int32_t> source;
  /// Distance of the point from the other camera minus that from this one.
  std::vector<float> farther_m;
};

}  // namespace core
