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
      // Squares of light of 1e20 and more are no floats.
      double noise = 0;
      for (int c = 0; c < 3; ++c) {
        const auto va = static_cast<double>(a.mean[c]);
        const auto vb = static_cast<double>(b.mean[c]);
        noise += 0.25 * (va - vb) * (va - vb);
        out.signal += va * vb;
      }
      out.noise += noise;
      out.noise_squares += noise * noise;
      if (a.alpha + b.alpha > 0) {
        out.luminance +=
            0.5 * (static_cast<double>(luminance(a.mean)) + static_cast<double>(luminance(b.mean)));
        ++out.pixels;
      }
    }
  }
  return out;
}

}  // namespace core
