#include "core/film/error_estimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/base/statistics.h"

namespace core {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr double kRegularizer = 0.01;  // DESIGN section 3: Var / (mu^2 + 0.01)
constexpr std::array<int, 7> kRadii = {1, 2, 3, 5, 8, 16, 32};

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
  /// Half-open.
  double sum(int x0, int y0, int x1, int y1) const {
    const auto at = [this](int x, int y) {
      return sums_[static_cast<std::size_t>(y) * stride_ + static_cast<std::size_t>(x)];
    };
    return at(x1, y1) - at(x0, y1) - at(x1, y0) + at(x0, y0);
  }

 private:
  std::size_t stride_;
  std::vector<double> sums_;
};

}  // namespace

std::size_t ErrorEstimate::index(int x, int y) const noexcept {
  return static_cast<std::size_t>(y - rect_.y) * static_cast<std::size_t>(rect_.width) +
         static_cast<std::size_t>(x - rect_.x);
}

ErrorEstimate::ErrorEstimate(const FilmSnapshot& film) : rect_(film.rect) {
  const int w = rect_.width;
  const int h = rect_.height;
  const std::size_t n = film.pixel_count();
  mean_.resize(n);
  std::array<SummedArea, 3> means = {SummedArea(w, h), SummedArea(w, h), SummedArea(w, h)};
  std::array<SummedArea, 3> variances = {SummedArea(w, h), SummedArea(w, h), SummedArea(w, h)};
  std::vector<Rgb> raw(n);
  valid_ = n > 0;
  for (int y = 0; y < h && valid_; ++y) {
    for (int x = 0; x < w; ++x) {
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x);
      const HalfValue a = half_value(film, i, 0);
      const HalfValue b = half_value(film, i, 1);
      if (a.count == 0 || b.count == 0) {
        valid_ = false;
        break;
      }
      mean_[i] = pixel_value(film, i).mean;
      const Rgb d = a.mean - b.mean;
      raw[i] = d * d * 0.25F;
      for (int c = 0; c < 3; ++c) {
        means[static_cast<std::size_t>(c)].set(x, y, static_cast<double>(mean_[i][c]));
        variances[static_cast<std::size_t>(c)].set(x, y, static_cast<double>(raw[i][c]));
      }
    }
  }
  if (!valid_) {
    for (std::size_t i = 0; i < n; ++i) {
      mean_[i] = pixel_value(film, i).mean;
    }
    return;
  }
  pooled_variance_.resize(n);
  raw_ratio_.resize(n);
  pooled_ratio_.resize(n);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x);
      std::array<double, 3> mu{};
      std::array<double, 3> variance{};
      // The window grows until mu^2 is known to about 10 %: with K events in it, the ratio of the
      // pooled variance to mu^2 has a bias of 1/K.
      for (const int r : kRadii) {
        const int x0 = std::max(x - r, 0);
        const int y0 = std::max(y - r, 0);
        const int x1 = std::min(x + r + 1, w);
        const int y1 = std::min(y + r + 1, h);
        const double count = static_cast<double>(x1 - x0) * static_cast<double>(y1 - y0);
        double noise = 0;
        double signal = 0;
        for (std::size_t c = 0; c < 3; ++c) {
          mu[c] = means[c].sum(x0, y0, x1, y1) / count;
          variance[c] = std::max(variances[c].sum(x0, y0, x1, y1), 0.0) / count;
          noise += variance[c] / count;
          signal += mu[c] * mu[c] + kRegularizer;
        }
        if (noise <= 0.01 * signal) {
          break;
        }
      }
      double raw_sum = 0;
      double pooled_sum = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const double scale = 1 / (mu[c] * mu[c] + kRegularizer);
        raw_sum += static_cast<double>(raw[i][static_cast<int>(c)]) * scale;
        pooled_sum += variance[c] * scale;
      }
      pooled_variance_[i] = {static_cast<float>(variance[0]), static_cast<float>(variance[1]),
                             static_cast<float>(variance[2])};
      raw_ratio_[i] = static_cast<float>(raw_sum / 3);
      pooled_ratio_[i] = static_cast<float>(pooled_sum / 3);
    }
  }
}

ErrorInterval ErrorEstimate::image(double confidence) const { return region(rect_, confidence); }

ErrorInterval ErrorEstimate::region(PixelRect rect, double confidence) const {
  ErrorInterval out;
  const auto nan = std::numeric_limits<double>::quiet_NaN();
  out.relative_rmse = out.low = out.high = nan;
  const double n = static_cast<double>(rect.width) * static_cast<double>(rect.height);
  if (!valid_ || n < 1) {
    return out;
  }
  // Q = mean of the raw ratios. Each has one degree of freedom, or less where events are rare: its
  // own variance is taken from the differences of neighbours, which share their expected value, and is
  // never less than the 2 q^2 of a Gaussian.
  double sum = 0;
  double pairs = 0;
  double gaussian = 0;
  double largest = 0;
  for (int y = rect.y; y < rect.y + rect.height; ++y) {
    for (int x = rect.x; x < rect.x + rect.width; ++x) {
      const auto q = static_cast<double>(raw_ratio_[index(x, y)]);
      const auto pooled = static_cast<double>(pooled_ratio_[index(x, y)]);
      sum += q;
      largest = std::max(largest, q);
      gaussian += 2 * pooled * pooled;
      const int column = x - rect.x;
      if (column % 2 == 1) {
        const double d = q - static_cast<double>(raw_ratio_[index(x - 1, y)]);
        pairs += d * d;
      } else if (column + 1 == rect.width) {
        pairs += 2 * pooled * pooled;
      }
    }
  }
  const double q = sum / n;
  out.relative_rmse = std::sqrt(q);
  if (!(q > 0)) {
    out.low = out.high = 0;
    return out;
  }
  const double variance = std::max(pairs, gaussian) / (n * n);
  // Gamma with the same mean and variance: q * chi2(k) / k with k = 2 q^2 / variance.
  const double k = std::max(2 * q * q / variance, 0.5);
  const double tail = (1 - confidence) / 2;
  out.low = std::sqrt(q * k / chi2_quantile(1 - tail, k));
  out.high = std::sqrt(q * k / chi2_quantile(tail, k));
  // Fewer than some ten events carry the whole estimate: what was not seen cannot be bounded.
  out.unreliable = k < 20 || largest > 0.25 * sum;
  return out;
}

PixelError ErrorEstimate::pixel(int x, int y) const {
  PixelError out;
  const std::size_t i = index(x, y);
  if (!valid_) {
    out.standard_error = out.low = out.high = Rgb(kNan);
    return out;
  }
  const Rgb v = pooled_variance_[i];
  out.standard_error = {std::sqrt(v.r), std::sqrt(v.g), std::sqrt(v.b)};
  constexpr float kNormal975 = 1.959964F;
  out.low = mean_[i] - out.standard_error * kNormal975;
  out.high = mean_[i] + out.standard_error * kNormal975;
  return out;
}

float ErrorEstimate::relative_error(int x, int y) const {
  return valid_ ? std::sqrt(pooled_ratio_[index(x, y)]) : kNan;
}

}  // namespace core
