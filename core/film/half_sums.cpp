#include "core/film/half_sums.h"

#include <cstddef>

namespace core {

TileSums half_sums(const PixelRect& rect, std::span<const ReplicatePixel> pixels, int replicates) {
  TileSums out;
  out.has_halves = !pixels.empty();
  const auto r = static_cast<std::size_t>(replicates);
  std::size_t at = 0;
  for (int y = rect.y; out.has_halves && y < rect.y + rect.height; ++y) {
    for (int x = rect.x; x < rect.x + rect.width; ++x, at += r) {
      const HalfValue a = half_value(pixels.subspan(at, r), 0);
      const HalfValue b = half_value(pixels.subspan(at, r), 1);
      out.has_halves = out.has_halves && a.count > 0 && b.count > 0;
      const Rgb d = a.mean - b.mean;
      const double noise = 0.25 * static_cast<double>(d.r * d.r + d.g * d.g + d.b * d.b);
      out.noise += noise;
      out.noise_squares += noise * noise;
      const Rgb product = a.mean * b.mean;
      out.signal += static_cast<double>(product.r + product.g + product.b);
      if (a.alpha + b.alpha > 0) {
        out.luminance += static_cast<double>(0.5F * luminance(a.mean + b.mean));
        ++out.pixels;
      }
    }
  }
  return out;
}

}  // namespace core
