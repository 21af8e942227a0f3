/// SummedArea: computes sums over any rectangle of an image in constant time, in double.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/settings/settings.h"

namespace core {

class SummedArea {
 public:
  SummedArea(int width, int height) : stride_(static_cast<std::size_t>(width) + 1) {
    sums_.assign(stride_ * (static_cast<std::size_t>(height) + 1), 0.0);
  }
  /// Sets a value; call with increasing rows and columns.
  void set(int x, int y, double value) {
    const std::size_t i =
        (static_cast<std::size_t>(y) + 1) * stride_ + static_cast<std::size_t>(x) + 1;
    sums_[i] = value + sums_[i - 1] + sums_[i - stride_] - sums_[i - stride_ - 1];
  }
  double sum(const PixelRect& r) const {
    const auto at = [this](int x, int y) {
      return sums_[static_cast<std::size_t>(y) * stride_ + static_cast<std::size_t>(x)];
    };
    return at(r.x + r.width, r.y + r.height) - at(r.x, r.y + r.height) - at(r.x + r.width, r.y) +
           at(r.x, r.y);
  }

 private:
  std::size_t stride_;
  std::vector<double> sums_;
};

/// Returns the pixels of the image at most `radius` away in x and in y.
inline PixelRect window_around(int x, int y, int radius, int width, int height) {
  const int x0 = std::max(x - radius, 0);
  const int y0 = std::max(y - radius, 0);
  return {x0, y0, std::min(x + radius + 1, width) - x0, std::min(y + radius + 1, height) - y0};
}

}  // namespace core
