#include "core/layers/exposure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/color/rgb.h"
#include "core/layers/layer_rows.h"
#include "core/layers/layers.h"

namespace core {
namespace {

constexpr double kMiddleGrey = 0.18;
constexpr double kClippedMost = 0.1;
constexpr double kStopsMost = 30;  // of /v1/jobs/{id}/image
/// Sums of filtered samples of exactly 1 are above 1 by rounding.
constexpr float kWhite = 1.001F;

/// Weights of log2 luminances, in steps of 1/64 stop.
class Histogram {
 public:
  void add(double stops, double weight) {
    const double at = (stops - kFirst) * kSteps;
    bins_[static_cast<std::size_t>(std::clamp(at, 0.0, static_cast<double>(bins_.size() - 1)))] +=
        weight;
    sum_ += weight;
  }
  /// Returns the middle of the bin in which a share `q` of the weight is reached.
  double quantile(double q) const {
    double below = 0;
    std::size_t i = 0;
    while (i + 1 < bins_.size() && (below += bins_[i]) < q * sum_) {
      ++i;
    }
    return kFirst + (static_cast<double>(i) + 0.5) / kSteps;
  }
  double sum() const { return sum_; }

 private:
  static constexpr int kSteps = 64;
  static constexpr int kFirst = -150;  // the range of floats
  static constexpr int kLast = 129;
  std::array<double, static_cast<std::size_t>((kLast - kFirst) * kSteps)> bins_{};
  double sum_ = 0;
};

double automatic(const Histogram& histogram, double log_average) {
  const double low = histogram.quantile(0.01);
  const double high = histogram.quantile(0.99);
  const double range = std::max(high - low, 1.0);  // nearly even images are middle grey
  const double key = std::clamp((2 * log_average - low - high) / range, -1.0, 1.0);
  const double stops = std::min(std::log2(kMiddleGrey) + 2 * key - log_average,
                                -histogram.quantile(1 - kClippedMost));
  return std::clamp(std::round(10 * stops) / 10, -kStopsMost, kStopsMost) + 0.0;  // no -0
}

}  // namespace

Brightness brightness_of(const Film& film, const FilmSettings& settings) {
  Brightness out;
  auto layer = LayerRows::create(film, film.crop(), std::string(kBeauty), settings);
  if (!layer) {
    return out;  // every film has it
  }
  const ImageRows image = layer->rows();
  const auto channels = static_cast<std::size_t>(image.channels());
  Histogram histogram;
  double sum = 0;
  std::int64_t clipped = 0;
  for (int y = 0; y < image.height; ++y) {
    const float* in = image.row(y);
    for (int x = 0; x < image.width; ++x, in += channels) {
      const float alpha = std::clamp(in[3], 0.0F, 1.0F);
      const float light = luminance({in[0], in[1], in[2]}) / alpha;
      if (!(light > 0) || !std::isfinite(light)) {
        continue;
      }
      const double stops = std::log2(static_cast<double>(light));
      histogram.add(stops, static_cast<double>(alpha));
      sum += stops * static_cast<double>(alpha);
      clipped += light > kWhite ? 1 : 0;
    }
  }
  if (histogram.sum() > 0) {
    out.clipped = static_cast<double>(clipped) / image.width / image.height;
    out.auto_exposure = automatic(histogram, sum / histogram.sum());
  }
  return out;
}

std::string exposure_text(double stops) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g", stops);
  return text.data();
}

std::string clipped_warning(const Brightness& brightness, std::string_view option) {
  return std::to_string(static_cast<int>(100 * brightness.clipped)) + std::string(kClippedWords) +
         "; " + std::string(option) + exposure_text(brightness.auto_exposure) + " shows them";
}

}  // namespace core
