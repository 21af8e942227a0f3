#include "server/pictures/image_range.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace server {

ValueRange value_range(const core::ImageRows& image, const api::ImageRange& asked) {
  if (asked.ends) {
    return {(*asked.ends)[0], (*asked.ends)[1]};
  }
  ValueRange range{std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
  const std::size_t row_values = static_cast<std::size_t>(image.width) * image.channel_names.size();
  for (int y = 0; y < image.height; ++y) {
    for (const float v : std::span(image.row(y), row_values)) {
      if (std::isfinite(v) && v != 0) {
        range.low = std::min(range.low, v);
        range.high = std::max(range.high, v);
      }
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

core::ImageRows rescaled(core::ImageRows image, ValueRange range) {
  const float scale = 1 / (range.high - range.low);
  const std::size_t row_values = static_cast<std::size_t>(image.width) * image.channel_names.size();
  image.row = [row = std::move(image.row), out = std::vector<float>(row_values), range,
               scale](int y) mutable {
    const float* in = row(y);
    std::transform(in, in + out.size(), out.begin(),
                   [&](float v) { return std::isfinite(v) ? (v - range.low) * scale : 0.0F; });
    return static_cast<const float*>(out.data());
  };
  return image;
}

}  // namespace server
