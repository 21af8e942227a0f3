#include "server/pictures/image_scale.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

namespace server {
namespace {

/// Returns the part of [begin, end) that lies in pixel `i`.
float overlap(int i, double begin, double end) {
  const double part = std::min(end, i + 1.0) - std::max(begin, static_cast<double>(i));
  return static_cast<float>(std::max(part, 0.0));
}

/// One row of the downscaled image, from the rows that it covers.
class ScaledRow {
 public:
  ScaledRow(core::ImageRows image, int width, int height)
      : image_(std::move(image)),
        width_(width),
        step_x_(static_cast<double>(image_.width) / width),
        step_y_(static_cast<double>(image_.height) / height),
        sum_(static_cast<std::size_t>(width) * image_.channel_names.size()),
        weight_(sum_.size()) {}

  const float* make(int y) {
    std::fill(sum_.begin(), sum_.end(), 0.0F);
    std::fill(weight_.begin(), weight_.end(), 0.0F);
    const int last_y = std::min(image_.height, static_cast<int>(std::ceil((y + 1) * step_y_)));
    for (int v = static_cast<int>(y * step_y_); v < last_y; ++v) {
      add(image_.row(v), overlap(v, y * step_y_, (y + 1) * step_y_));
    }
    for (std::size_t i = 0; i < sum_.size(); ++i) {
      sum_[i] = weight_[i] > 0 ? sum_[i] / weight_[i] : std::numeric_limits<float>::quiet_NaN();
    }
    return sum_.data();
  }

 private:
  void add(const float* row, float share) {
    const std::size_t channels = image_.channel_names.size();
    for (int x = 0; x < width_; ++x) {
      const int last_x = std::min(image_.width, static_cast<int>(std::ceil((x + 1) * step_x_)));
      for (int u = static_cast<int>(x * step_x_); u < last_x; ++u) {
        const float w = share * overlap(u, x * step_x_, (x + 1) * step_x_);
        for (std::size_t c = 0; c < channels; ++c) {
          const float value = row[static_cast<std::size_t>(u) * channels + c];
          const std::size_t to = static_cast<std::size_t>(x) * channels + c;
          if (std::isfinite(value)) {
            sum_[to] += w * value;
            weight_[to] += w;
          }
        }
      }
    }
  }

  core::ImageRows image_;
  int width_;
  double step_x_;
  double step_y_;
  std::vector<float> sum_;
  std::vector<float> weight_;
};

}  // namespace

core::ImageRows scaled_down(core::ImageRows image, int side_max) {
  const int longest = std::max(image.width, image.height);
  if (longest <= side_max) {
    return image;
  }
  const double ratio = static_cast<double>(longest) / side_max;
  core::ImageRows small;
  small.channel_names = image.channel_names;
  small.width = std::max(1, static_cast<int>(std::lround(image.width / ratio)));
  small.height = std::max(1, static_cast<int>(std::lround(image.height / ratio)));
  const auto row = std::make_shared<ScaledRow>(std::move(image), small.width, small.height);
  small.row = [row](int y) { return row->make(y); };
  return small;
}

}  // namespace server
