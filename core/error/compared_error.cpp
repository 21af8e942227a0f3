#include "core/error/compared_error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "core/base/check.h"
#include "core/error/pixel_error.h"
#include "core/error/squared_error.h"

namespace core {
namespace {

ColorSum color_of(const HalfValue& value) {
  return {static_cast<double>(value.mean.r), static_cast<double>(value.mean.g),
          static_cast<double>(value.mean.b)};
}

/// The image as it is compared: by its mean, or by its halves.
enum class Side { kMean, kHalves };

ErrorRoots roots_of(const FilmSnapshot& image, const FilmSnapshot& references, Side side) {
  CHECK(image.pixel_count() == references.pixel_count());
  const double floor = floor_of(references);
  SquaredErrors squares(references.rect);
  std::size_t i = 0;
  for (int y = 0; y < references.rect.height; ++y) {
    for (int x = 0; x < references.rect.width; ++x, ++i) {
      const auto [u, v] = error_halves(references, i);
      const auto [fa, fb] = error_halves(image, i);
      const ColorSum mean = color_of(pixel_value(fa, fb));
      ColorSum scale{};
      for (std::size_t c = 0; c < 3; ++c) {
        scale[c] = std::abs(mean[c]) + floor;
      }
      const ColorSum a = side == Side::kMean ? mean : color_of(fa);
      const ColorSum b = side == Side::kMean ? mean : color_of(fb);
      const double square = relative_square(mean, color_of(pixel_value(u, v)), scale);
      squares.set(x, y, relative_product(a, color_of(u), b, color_of(v), scale), {square, 0},
                  !is_empty(u, v));
    }
  }
  return squares.roots();
}

}  // namespace

ErrorEstimate compared_error(const FilmSnapshot& image, const FilmSnapshot& references) {
  return {half_sums(references), roots_of(image, references, Side::kMean), references.errors};
}

double compared_bias(const FilmSnapshot& image, const FilmSnapshot& references) {
  const std::vector<TileSums> sums = half_sums(references);
  const auto has_halves = [](const std::vector<TileSums>& tiles) {
    return std::all_of(tiles.begin(), tiles.end(), [](const TileSums& t) { return t.has_halves; });
  };
  if (!has_halves(sums) || !has_halves(half_sums(image))) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const std::vector<double> roots = roots_of(image, references, Side::kHalves).tiles;
  const double pixels = std::accumulate(sums.begin(), sums.end(), 0.0,
                                        [](double n, const TileSums& t) { return n + t.pixels; });
  return pixels > 0 ? std::accumulate(roots.begin(), roots.end(), 0.0) / pixels : 0;
}

}  // namespace core
