/// LightNotFound: how much of a picture's light may be missing from it
/// (core/render/picture/light_not_found.h).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace core {

struct LightNotFound {
  double at_most = 0;   ///< with the confidence, over the picture's mean luminance
  double detected = 0;  ///< found by the census and missing, over the picture's mean luminance
  double confidence = 0.95;
  std::uint32_t particles = 0;
  std::vector<int> tiles;  ///< that lack light
  std::string reason;      ///< a sentence: which light, and what finds its light; empty: none lacks
  std::vector<std::string> integrators;  ///< that find that light, as in `reason`
};

}  // namespace core
