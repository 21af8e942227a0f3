#include "core/denoise/flicker.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/base/statistics.h"
#include "core/error/pixel_error.h"
#include "core/error/squared_error.h"

namespace core {
namespace {

/// Side of the tiles over which sums are taken to be independent: that of the denoiser's windows,
/// two radii and patches wide (core/denoise/statistical.cpp), rounded up to a power of two.
constexpr int kTile = 32;

/// One pixel of a frame, as errors are measured.
struct FramePixel {
  ColorSum a;
  ColorSum b;
  ColorSum shown_a;
  ColorSum shown_b;
};
FramePixel frame_pixel(const ShownFrame& frame, std::size_t i) {
  const auto [a, b] = error_halves(*frame.film, i);
  const DenoisedPicture& picture = *frame.picture;
  const float white = picture.full_alpha.empty() ? 0 : 1 - picture.full_alpha[i];
  FramePixel out;
  for (std::size_t c = 0; c < 3; ++c) {
    out.a[c] = static_cast<double>(a.mean[static_cast<int>(c)]);
    out.b[c] = static_cast<double>(b.mean[static_cast<int>(c)]);
    const auto shown = static_cast<double>(picture.full[c][i] + white);
    const auto apart = static_cast<double>(picture.apart[c][i]);
    out.shown_a[c] = shown + apart;
    out.shown_b[c] = shown - apart;
  }
  return out;
}

ColorSum difference(const ColorSum& x, const ColorSum& y) {
  return {x[0] - y[0], x[1] - y[1], x[2] - y[2]};
}

}  // namespace

Flicker& Flicker::operator+=(const Flicker& other) noexcept {
  pixels += other.pixels;
  sum += other.sum;
  variance += other.variance;
  degrees += other.degrees;
  return *this;
}

std::optional<FlickerInterval> interval(const Flicker& flicker, double confidence) {
  if (!(flicker.degrees > 0)) {
    return std::nullopt;
  }
  const double mean = flicker.sum / flicker.pixels;
  const double reach = student_t_quantile(0.5 + 0.5 * confidence, flicker.degrees) *
                       std::sqrt(flicker.variance) / flicker.pixels;
  const auto root = [](double square) { return std::sqrt(std::max(square, 0.0)); };
  return FlickerInterval{root(mean), root(mean - reach), root(mean + reach)};
}

Flicker flicker(const ShownFrame& now, const ShownFrame& other, const FrameMatch& match) {
  const PixelRect& rect = now.film->rect;
  const double floor = floor_of(*now.film);
  const int columns = (rect.width + kTile - 1) / kTile;
  const int rows = (rect.height + kTile - 1) / kTile;
  std::vector<Flicker> tiles(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  std::size_t i = 0;
  for (int y = 0; y < rect.height; ++y) {
    for (int x = 0; x < rect.width; ++x, ++i) {
      if (match.source[i] < 0) {
        continue;
      }
      const FramePixel here = frame_pixel(now, i);
      const FramePixel there = frame_pixel(other, static_cast<std::size_t>(match.source[i]));
      const ColorSum shown_a = difference(here.shown_a, there.shown_a);
      const ColorSum shown_b = difference(here.shown_b, there.shown_b);
      ColorSum mean;
      ColorSum scale;
      for (std::size_t c = 0; c < 3; ++c) {
        mean[c] = 0.5 * (shown_a[c] + shown_b[c]);
        scale[c] = std::abs(0.5 * (here.shown_a[c] + here.shown_b[c])) + floor;
      }
      Flicker& tile = tiles[static_cast<std::size_t>(y / kTile * columns + x / kTile)];
      tile.pixels += 1;
      tile.sum += relative_product(shown_a, difference(here.a, there.a), shown_b,
                                   difference(here.b, there.b), scale) +
                  relative_square(shown_a, mean, scale);
    }
  }
  Flicker out;
  double seen = 0;
  for (const Flicker& tile : tiles) {
    out += tile;
    seen += tile.pixels > 0 ? 1 : 0;
  }
  if (seen > 1) {
    out.degrees = seen - 1;
    for (const Flicker& tile : tiles) {
      const double apart = tile.sum - tile.pixels * out.sum / out.pixels;
      out.variance += apart * apart * seen / (seen - 1);
    }
  }
  return out;
}

}  // namespace core
