/// Sums of means and variances over any rectangle of a picture, and what follows: where the
/// expected value is one and the same, as far as the noise lets us tell.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/color/rgb.h"
#include "core/render/settings.h"

namespace core {

/// Sums over any rectangle of an image in constant time, in double.
class SummedArea {
 public:
  SummedArea(int width, int height) : stride_(static_cast<std::size_t>(width) + 1) {
    sums_.assign(stride_ * (static_cast<std::size_t>(height) + 1), 0.0);
  }
  /// Rows and columns in increasing order.
  void set(int x, int y, double value) {
    const std::size_t i = (static_cast<std::size_t>(y) + 1) * stride_ + static_cast<std::size_t>(x) + 1;
    sums_[i] = value + sums_[i - 1] + sums_[i - stride_] - sums_[i - stride_ - 1];
  }
  double sum(const PixelRect& r) const {
    const auto at = [this](int x, int y) {
      return sums_[static_cast<std::size_t>(y) * stride_ + static_cast<std::size_t>(x)];
    };
    return at(r.x + r.width, r.y + r.height) - at(r.x, r.y + r.height) - at(r.x + r.width, r.y) + at(r.x, r.y);
  }

 private:
  std::size_t stride_;
  std::vector<double> sums_;
};

/// The pixels at most `radius` away in x and in y, within the picture.
inline PixelRect window_around(int x, int y, int radius, int width, int height) {
  const int x0 = std::max(x - radius, 0);
  const int y0 = std::max(y - radius, 0);
  return {x0, y0, std::min(x + radius + 1, width) - x0, std::min(y + radius + 1, height) - y0};
}

/// Per channel, over pixels: the pixel's mean, and the estimated variance of that mean. Rectangles in pixels
/// of this picture, inside it.
class MomentSums {
 public:
  /// Var / (mu^2 + kRegularizer): DESIGN section 3.
  static constexpr double kRegularizer = 0.01;

  enum class Of { kWhole, kPart };
  /// kPart: of a part of something, which is what has to be known.
  MomentSums(int width, int height, Of of = Of::kWhole);
  /// Rows and columns in increasing order. variance >= 0.
  void set(int x, int y, Rgb mean, Rgb variance) { set(x, y, mean, variance, mean); }
  void set(int x, int y, Rgb mean, Rgb variance, Rgb whole);

  struct Values {
    std::array<double, 3> mean{};      ///< over the rectangle
    std::array<double, 3> variance{};  ///< of one pixel, mean over the rectangle
    std::array<double, 3> whole{};     ///< over the rectangle
    double count = 0;                  ///< pixels
    /// Variance of the rectangle's mean over (the square of the whole + kRegularizer), channels together.
    double relative_variance() const;
  };
  Values over(const PixelRect& rect) const;

  /// Of each pixel: its own mean where that is well known, else the mean of a rectangle around it, which ends where
  /// values differ by more than noise explains. Rectangles come from halving the picture, and cutting at edges, top down;
  /// O(pixels).
  struct Region {
    Rgb mean;
    std::uint32_t part = 0;  ///< the rectangle's number, below that of the pixels
  };
  std::vector<Region> regions() const;

 private:
  void divide(const PixelRect& rect, std::uint32_t& parts, std::vector<Region>& out) const;
  bool is_known(const PixelRect& rect) const;
  PixelRect grown(const PixelRect& rect) const;

  using Sums = std::array<double, 6>;  ///< of the three means, then of the three variances
  int width_;
  int height_;
  std::size_t stride_;
  std::vector<Sums> sums_;  ///< over all pixels above and left of a corner
  std::vector<std::array<double, 3>> wholes_;  ///< the same; empty unless of parts
};

}  // namespace core
