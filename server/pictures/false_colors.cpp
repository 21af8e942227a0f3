#include "server/pictures/false_colors.h"

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/color/rgb.h"
#include "core/layers/layer_rows.h"

namespace server {
namespace {

/// Hues of adjacent ids differ by the golden ratio's share of the circle, so that they are far
/// apart; lightness alternates.
core::Rgb color_of(std::uint32_t id) {
  if (id == 0) {
    return {};
  }
  constexpr double kGolden = 0.6180339887498949;
  const double turn = static_cast<double>(id) * kGolden;
  const auto hue = static_cast<float>(6 * (turn - std::floor(turn)));
  const float value = id % 2 == 0 ? 0.65F : 0.95F;
  const auto part = [hue, value](float middle) {
    const float off = std::fabs(hue - middle);
    const float away = off > 3 ? 6 - off : off;
    const float full = away < 1 ? 1.0F : away < 2 ? 2 - away : 0.0F;
    return value * (0.3F + 0.7F * full);
  };
  return {part(0), part(2), part(4)};
}

}  // namespace

core::ImageRows false_colors(core::ImageRows image, core::LayerForm form) {
  const std::size_t channels = image.channel_names.size();
  const auto width = static_cast<std::size_t>(image.width);
  image.channel_names = {"R", "G", "B"};
  image.row = [row = std::move(image.row), out = std::vector<float>(3 * width), channels,
               form](int y) mutable {
    const float* in = row(y);
    for (std::size_t i = 0; i < out.size(); i += 3, in += channels) {
      core::Rgb sum;
      if (form == core::LayerForm::kIds) {
        sum = color_of(static_cast<std::uint32_t>(in[0]));
      } else {
        for (std::size_t k = 0; k < channels; k += 2) {
          sum += color_of(std::bit_cast<std::uint32_t>(in[k])) * in[k + 1];
        }
      }
      out[i] = sum.r;
      out[i + 1] = sum.g;
      out[i + 2] = sum.b;
    }
    return static_cast<const float*>(out.data());
  };
  return image;
}

}  // namespace server
