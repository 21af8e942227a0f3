#include "server/routes/image_scale.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace server {
namespace {

/// The part of [begin, end) that lies in pixel `i`.
float overlap(int i, double begin, double end) {
  const double part = std::min(end, i + 1.0) - std::max(begin, static_cast<double>(i));
  return static_cast<float>(std::max(part, 0.0));
}

}  // namespace

core::FloatImage scaled_down(core::FloatImage image, int side_max) {
  const int longest = std::max(image.width, image.height);
  if (longest <= side_max) {
    return image;
  }
  core::FloatImage small;
  small.channel_names = image.channel_names;
  const double ratio = static_cast<double>(longest) / side_max;
  small.width = std::max(1, static_cast<int>(std::lround(image.width / ratio)));
  small.height = std::max(1, static_cast<int>(std::lround(image.height / ratio)));
  const auto channels = static_cast<std::size_t>(image.channels());
  small.values.resize(static_cast<std::size_t>(small.width) *
                      static_cast<std::size_t>(small.height) * channels);
  const double step_x = static_cast<double>(image.width) / small.width;
  const double step_y = static_cast<double>(image.height) / small.height;
  std::vector<float> sum(channels);
  std::vector<float> weight(channels);
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      std::fill(sum.begin(), sum.end(), 0.0F);
      std::fill(weight.begin(), weight.end(), 0.0F);
      const int last_y = std::min(image.height, static_cast<int>(std::ceil((y + 1) * step_y)));
      const int last_x = std::min(image.width, static_cast<int>(std::ceil((x + 1) * step_x)));
      for (int v = static_cast<int>(y * step_y); v < last_y; ++v) {
        for (int u = static_cast<int>(x * step_x); u < last_x; ++u) {
          const float w =
              overlap(u, x * step_x, (x + 1) * step_x) * overlap(v, y * step_y, (y + 1) * step_y);
          const float* value = &image.values[image.index(u, v, 0)];
          for (std::size_t c = 0; c < channels; ++c) {
            if (std::isfinite(value[c])) {
              sum[c] += w * value[c];
              weight[c] += w;
            }
          }
        }
      }
      float* out = &small.values[small.index(x, y, 0)];
      for (std::size_t c = 0; c < channels; ++c) {
        out[c] = weight[c] > 0 ? sum[c] / weight[c] : std::numeric_limits<float>::quiet_NaN();
      }
    }
  }
  return small;
}

}  // namespace server
