#include "server/routes/image_range.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace server {

ValueRange value_range(const core::FloatImage& image, const api::ImageRange& asked) {
  if (asked.ends) {
    return {(*asked.ends)[0], (*asked.ends)[1]};
  }
  ValueRange range{std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
  for (const float v : image.values) {
    if (std::isfinite(v) && v != 0) {
      range.low = std::min(range.low, v);
      range.high = std::max(range.high, v);
    }
  }
  if (range.low > range.high) {
    return {};
  }
  if (range.low < 0) {
    range.high = std::max(range.high, -range.low);
    range.low = -range.high;
  }
  return range.low < range.high ? range : ValueRange{0, range.high};
}

core::FloatImage rescaled(core::FloatImage image, ValueRange range) {
  const float scale = 1 / (range.high - range.low);
  for (float& v : image.values) {
    v = std::isfinite(v) ? (v - range.low) * scale : 0;
  }
  return image;
}

}  // namespace server
