#include "core/denoise/series_mean.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/base/check.h"
#include "core/denoise/feature_guides.h"
#include "core/film/half_sums.h"
#include "core/film/summed_area.h"

namespace core {
namespace {

/// Pixels on each side of the windows whose means are compared, as the patches of
/// core/denoise/statistical.cpp.
constexpr int kWindow = 2;
/// Variance of every pixel, as a fraction of the floor of the error squared, as there.
constexpr double kInvisible = 0.01;

/// One half without visible emission and divided by the colour of the surfaces.
struct Light {
  ColorPlanes plain;
  Plane variance;  ///< of `plain`, summed over the channels
  ColorPlanes clean;
};

Light light_of(const HalfPicture& half, const ColorPlanes& clean, const FeaturePicture* features) {
  Light out = {half.mean, half.variance, clean};
  if (features == nullptr) {
    return out;
  }
  const ColorPlanes colors = surface_colors(*features);
  for (std::size_t i = 0; i < out.variance.size(); ++i) {
    float squares = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const float color = colors[c][i];
      const float emission = features->emission[c][i];
      out.plain[c][i] = (out.plain[c][i] - emission) / color;
      out.clean[c][i] = (out.clean[c][i] - emission) / color;
      squares += 1 / (color * color);
    }
    out.variance[i] *= squares / 3;
  }
  return out;
}

/// Returns the variance that no eye sees.
double invisible(const ColorPlanes& light) {
  double sum = 0;
  for (std::size_t i = 0; i < light[0].size(); ++i) {
    sum += static_cast<double>(luminance({light[0][i], light[1][i], light[2][i]}));
  }
  const double mean = sum / static_cast<double>(std::max<std::size_t>(light[0].size(), 1));
  const double dark = error_floor(std::sqrt(std::max(mean, 0.0)));
  return std::max(3 * kInvisible * dark * dark, 1e-20);
}

/// Returns the weights of the neighbour's pixels: `agreement` of their features where the plain
/// light does not differ.
Plane weights_of(const Light& here, const Light& there, const FrameMatch& match,
                 const Plane& agreement, int width) {
  const auto height = static_cast<int>(agreement.size() / static_cast<std::size_t>(width));
  std::array<SummedArea, 3> apart = {SummedArea(width, height), SummedArea(width, height),
                                     SummedArea(width, height)};
  SummedArea noise(width, height);
  const double least = invisible(here.plain);
  std::size_t i = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, ++i) {
      const bool is_pair = agreement[i] > 0;
      const std::size_t j = is_pair ? static_cast<std::size_t>(match.source[i]) : 0;
      for (std::size_t c = 0; c < 3; ++c) {
        apart[c].set(x, y, is_pair ? static_cast<double>(here.plain[c][i] - there.plain[c][j]) : 0);
      }
      noise.set(x, y,
                is_pair ? static_cast<double>(here.variance[i] + there.variance[j]) + least : 0);
    }
  }
  Plane out(agreement.size());
  i = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, ++i) {
      if (!(agreement[i] > 0)) {
        continue;
      }
      const PixelRect window = window_around(x, y, kWindow, width, height);
      double squares = 0;
      for (const SummedArea& channel : apart) {
        const double sum = channel.sum(window);
        squares += sum * sum;
      }
      const auto deviations2 = static_cast<float>(squares / noise.sum(window));
      const float near = std::max(1 - deviations2 * (1 / kMostDeviations2), 0.0F);
      out[i] = agreement[i] * near * near;
    }
  }
  return out;
}

/// 1 where there is a source.
Plane matched(const FrameMatch& match) {
  Plane out(match.source.size());
  std::transform(match.source.begin(), match.source.end(), out.begin(),
                 [](std::int32_t from) { return from < 0 ? 0.0F : 1.0F; });
  return out;
}

}  // namespace

std::vector<ColorPlanes> mean_of_frames(const CleanHalves& own, const FeaturePicture* features,
                                        std::span<const SeriesFrame> frames) {
  std::vector<Light> here;
  std::vector<ColorPlanes> out;
  std::vector<Plane> weights;
  for (std::size_t h = 0; h < own.plain.size(); ++h) {
    here.push_back(light_of(own.plain[h], own.clean[h], features));
    out.push_back(here[h].clean);
    weights.emplace_back(here[h].variance.size(), 1.0F);
  }
  for (const SeriesFrame& frame : frames) {
    CHECK((frame.features != nullptr) == (features != nullptr));
    const FrameMatch& match = *frame.match;
    const Plane agreement = features != nullptr
                                ? agreement_with_source(*features, *frame.features, match)
                                : matched(match);
    for (std::size_t h = 0; h < out.size(); ++h) {
      const Light there = light_of(frame.halves->plain[h], frame.halves->clean[h], frame.features);
      const Plane weight = weights_of(here[h], there, match, agreement, own.plain[h].width);
      for (std::size_t i = 0; i < weight.size(); ++i) {
        if (weight[i] > 0) {
          const auto j = static_cast<std::size_t>(match.source[i]);
          for (std::size_t c = 0; c < 3; ++c) {
            out[h][c][i] += weight[i] * there.clean[c][j];
          }
          weights[h][i] += weight[i];
        }
      }
    }
  }
  const ColorPlanes colors = features != nullptr ? surface_colors(*features) : ColorPlanes{};
  for (std::size_t h = 0; h < out.size(); ++h) {
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < weights[h].size(); ++i) {
        out[h][c][i] /= weights[h][i];
        if (features != nullptr) {
          out[h][c][i] = out[h][c][i] * colors[c][i] + features->emission[c][i];
        }
      }
    }
  }
  return out;
}

}  // namespace core
