#include "core/film/half_sums.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace core {
namespace {

constexpr std::size_t kSquares = std::size_t{kTileSize / kDoubtSize} * (kTileSize / kDoubtSize);

/// Sums over one square of doubt.
struct Square {
  double grain = 0;
  double difference = 0;  ///< D
  double doubtful = 0;    ///< d r
  double scale = 0;       ///< s
  std::uint32_t pixels = 0;
};

struct Halves {
  HalfValue a;
  HalfValue b;
};
Halves halves_of(std::span<const ReplicatePixel> pixel, bool over_white) {
  Halves out = {half_value(pixel, 0), half_value(pixel, 1)};
  if (over_white) {
    put_over_white(out.a, out.b);
  }
  return out;
}

}  // namespace

double root_of_light(Rgb color) {
  return std::sqrt(std::max(static_cast<double>(luminance(color)), 0.0));
}

PixelShare share_of_pixel(const HalfValue& a, const HalfValue& b, double floor) {
  PixelShare out = {.apart = 0, .scale = 6 * floor, .share = 0, .difference = 0};
  double most = 0;  // A - B in the channel where they differ most
  for (int c = 0; c < 3; ++c) {
    const auto of_a = static_cast<double>(a.mean[c]);
    const auto of_b = static_cast<double>(b.mean[c]);
    out.apart += std::abs(of_a - of_b);
    most = std::abs(of_a - of_b) > std::abs(most) ? of_a - of_b : most;
    out.scale += std::abs(of_a) + std::abs(of_b);
  }
  out.share = out.apart > 0 ? out.apart / out.scale : 0;
  out.difference = most < 0 ? -out.share : out.share;
  return out;
}

TileSums& TileSums::operator+=(const TileSums& other) {
  grain += other.grain;
  squares += other.squares;
  doubt += other.doubt;
  squares_of_blocks += other.squares_of_blocks;
  pixels += other.pixels;
  has_halves = has_halves && other.has_halves;
  return *this;
}

TileLight tile_light(const PixelRect& rect, std::span<const ReplicatePixel> pixels, int replicates,
                     bool over_white) {
  TileLight out;
  const auto r = static_cast<std::size_t>(replicates);
  const std::size_t count =
      static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height);
  for (std::size_t i = 0; i < count && !pixels.empty(); ++i) {
    const auto [a, b] = halves_of(pixels.subspan(i * r, r), over_white);
    if (!is_empty(a, b)) {
      out.roots += root_of_light(pixel_value(a, b).mean);
      ++out.pixels;
    }
  }
  return out;
}

TileSums half_sums(const PixelRect& rect, std::span<const ReplicatePixel> pixels, int replicates,
                   double floor, bool over_white) {
  TileSums out;
  out.has_halves = !pixels.empty();
  std::array<Square, kSquares> squares;
  const auto r = static_cast<std::size_t>(replicates);
  std::size_t i = 0;
  for (int y = rect.y; y < rect.y + rect.height && out.has_halves; ++y) {
    for (int x = rect.x; x < rect.x + rect.width && out.has_halves; ++x, ++i) {
      const auto [a, b] = halves_of(pixels.subspan(i * r, r), over_white);
      out.has_halves = a.count > 0 && b.count > 0;
      if (is_empty(a, b)) {
        continue;
      }
      const PixelShare of = share_of_pixel(a, b, floor);
      const int square =
          y % kTileSize / kDoubtSize * (kTileSize / kDoubtSize) + x % kTileSize / kDoubtSize;
      Square& sums = squares[static_cast<std::size_t>(square)];
      sums.grain += of.share;
      sums.difference += of.difference;
      sums.doubtful += of.apart * of.share;
      sums.scale += of.scale;
      ++sums.pixels;
      out.squares += of.share * of.share;
    }
  }
  for (const Square& square : squares) {
    const auto n = static_cast<double>(square.pixels);
    out.grain += square.grain;
    out.doubt += square.scale > 0 ? n * square.doubtful / square.scale : 0;
    out.squares_of_blocks += square.difference * square.difference;
    out.pixels += square.pixels;
  }
  return out;
}

}  // namespace core
