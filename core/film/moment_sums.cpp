#include "core/film/moment_sums.h"

#include <algorithm>
#include <utility>

namespace core {
namespace {

/// 1 / mu^2 is too large by three times this share on average, and by it once more where rare events make noise and
/// mean rise together.
constexpr double kKnownVariance = 0.004;
/// Squared standard deviations between two parts that are not one.
constexpr double kEdge = 16;
constexpr int kCuts = 64;  // places that are tried along a side

double total(const std::array<double, 3>& v) { return v[0] + v[1] + v[2]; }

std::pair<PixelRect, PixelRect> cut(const PixelRect& r, bool across, int at) {
  if (across) {
    return {{r.x, r.y, at, r.height}, {r.x + at, r.y, r.width - at, r.height}};
  }
  return {{r.x, r.y, r.width, at}, {r.x, r.y + at, r.width, r.height - at}};
}

}  // namespace

MomentSums::MomentSums(int width, int height, Of of)
    : width_(width), height_(height), stride_(static_cast<std::size_t>(width) + 1) {
  sums_.resize(stride_ * (static_cast<std::size_t>(height) + 1));
  wholes_.resize(of == Of::kPart ? sums_.size() : 0);
}

void MomentSums::set(int x, int y, Rgb mean, Rgb variance, Rgb whole) {
  const std::size_t i = (static_cast<std::size_t>(y) + 1) * stride_ + static_cast<std::size_t>(x) + 1;
  for (int c = 0; c < 3; ++c) {
    const auto at = static_cast<std::size_t>(c);
    const auto add = [&](std::size_t k, float value) {
      sums_[i][k] = static_cast<double>(value) + sums_[i - 1][k] + sums_[i - stride_][k] - sums_[i - stride_ - 1][k];
    };
    add(at, mean[c]);
    add(at + 3, variance[c]);
    if (!wholes_.empty()) {
      wholes_[i][at] = static_cast<double>(whole[c]) + wholes_[i - 1][at] + wholes_[i - stride_][at] - wholes_[i - stride_ - 1][at];
    }
  }
}

double MomentSums::Values::relative_variance() const {
  double noise = 0;
  double signal = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    noise += variance[c] / count;
    signal += whole[c] * whole[c] + kRegularizer;
  }
  return noise / signal;
}

MomentSums::Values MomentSums::over(const PixelRect& rect) const {
  Values v;
  v.count = static_cast<double>(rect.width) * static_cast<double>(rect.height);
  const double scale = 1 / v.count;
  const auto row0 = static_cast<std::size_t>(rect.y) * stride_;
  const auto row1 = row0 + static_cast<std::size_t>(rect.height) * stride_;
  const auto x0 = static_cast<std::size_t>(rect.x);
  const auto x1 = x0 + static_cast<std::size_t>(rect.width);
  const Sums& a = sums_[row0 + x0];
  const Sums& b = sums_[row0 + x1];
  const Sums& c = sums_[row1 + x0];
  const Sums& d = sums_[row1 + x1];
  for (std::size_t k = 0; k < 3; ++k) {
    v.mean[k] = (d[k] - c[k] - b[k] + a[k]) * scale;
    v.variance[k] = std::max(d[k + 3] - c[k + 3] - b[k + 3] + a[k + 3], 0.0) * scale;
    v.whole[k] = wholes_.empty() ? v.mean[k]
                                 : (wholes_[row1 + x1][k] - wholes_[row1 + x0][k] - wholes_[row0 + x1][k] + wholes_[row0 + x0][k]) * scale;
  }
  return v;
}

PixelRect MomentSums::grown(const PixelRect& r) const {
  const int x0 = std::max(r.x - 1, 0);
  const int y0 = std::max(r.y - 1, 0);
  return {x0, y0, std::min(r.x + r.width + 1, width_) - x0, std::min(r.y + r.height + 1, height_) - y0};
}

bool MomentSums::is_known(const PixelRect& rect) const {
  // One pixel's variance has one degree of freedom and is often near 0 by luck: its neighbours are asked too.
  Values v = over(rect);
  v.variance = over(grown(rect)).variance;
  return v.relative_variance() <= kKnownVariance;
}

void MomentSums::divide(const PixelRect& rect, std::uint32_t& parts, std::vector<Region>& out) const {
  if (rect.width * rect.height > 1) {
    const bool wide = rect.width >= rect.height;
    const auto halves = cut(rect, wide, (wide ? rect.width : rect.height) / 2);
    if (is_known(halves.first) && is_known(halves.second)) {
      divide(halves.first, parts, out);
      divide(halves.second, parts, out);
      return;
    }
    const double noise = total(over(grown(rect)).variance);
    // Variance of the mean of a part: its own, and as if four more pixels had that of the whole, because a few pixels
    // may be without noise by luck. Its own counts: the rim of a lamp is a part as noisy as it is different.
    const auto variance_of_mean = [noise](const Values& v) {
      return (v.count * total(v.variance) + 4 * noise) / ((v.count + 4) * v.count);
    };
    double best = kEdge;
    std::pair<PixelRect, PixelRect> best_parts;
    bool found = false;
    for (const bool across : {true, false}) {
      const int side = across ? rect.width : rect.height;
      int last = 0;
      for (int k = 1; k < kCuts; ++k) {
        const int at = side * k / kCuts;
        if (at == last) {
          continue;
        }
        last = at;
        const auto two = cut(rect, across, at);
        const Values a = over(two.first);
        const Values b = over(two.second);
        double difference = 0;
        for (std::size_t c = 0; c < 3; ++c) {
          difference += (a.mean[c] - b.mean[c]) * (a.mean[c] - b.mean[c]);
        }
        const double variance = variance_of_mean(a) + variance_of_mean(b);
        if (difference > best * variance) {
          best = variance > 0 ? difference / variance : 1e30;
          best_parts = two;
          found = true;
        }
      }
    }
    if (found) {
      divide(best_parts.first, parts, out);
      divide(best_parts.second, parts, out);
      return;
    }
  }
  const Values v = over(rect);
  const Region region = {{static_cast<float>(v.mean[0]), static_cast<float>(v.mean[1]), static_cast<float>(v.mean[2])}, parts++};
  for (int y = rect.y; y < rect.y + rect.height; ++y) {
    const auto row = out.begin() + static_cast<std::ptrdiff_t>(y) * width_ + rect.x;
    std::fill(row, row + rect.width, region);
  }
}

std::vector<MomentSums::Region> MomentSums::regions() const {
  std::vector<Region> out(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  if (!out.empty()) {
    std::uint32_t parts = 0;
    divide({0, 0, width_, height_}, parts, out);
  }
  return out;
}

}  // namespace core
