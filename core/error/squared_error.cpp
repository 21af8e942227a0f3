#include "core/error/squared_error.h"

#include <algorithm>
#include <cmath>

#include "core/film/film.h"

namespace core {
namespace {

/// A window of kEnergyWindow pixels within a tile.
struct Window {
  std::size_t tile = 0;
  double pixels = 0;  ///< counted ones
  double mean = 0;    ///< of m
  double noise = 0;   ///< standard deviation of mean, from its two colours
  double evenness = 0;
};

/// Returns the mean error, from the mean m and k.
double error_of(double mean, double evenness) {
  const double peak = std::sqrt(std::max(mean, 0.0)) / evenness;
  return evenness * evenness * peak / (1 + peak / 2);
}

}  // namespace

double relative_product(const ColorSum& x, const ColorSum& u, const ColorSum& y, const ColorSum& v,
                        const ColorSum& scale) {
  double product = 0;
  double sum = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double s = scale[c];
    sum += s;
    if (s > 0) {
      product += s * std::clamp((x[c] - u[c]) / s, -kBound, kBound) *
                 std::clamp((y[c] - v[c]) / s, -kBound, kBound);
    }
  }
  return sum > 0 ? product / sum : 0;
}

SquaredErrors::SquaredErrors(const PixelRect& rect)
    : rect_(rect),
      energies_(rect.width, rect.height),
      chessboard_(rect.width, rect.height),
      sizes_{SummedArea(rect.width, rect.height), SummedArea(rect.width, rect.height)},
      squares_(rect.width, rect.height),
      counts_(rect.width, rect.height) {}

void SquaredErrors::set(int x, int y, double m, std::array<double, 2> squares, bool counts) {
  const double value = counts ? m : 0;
  energies_.set(x, y, value);
  chessboard_.set(x, y, (x + y) % 2 == 0 ? value : -value);
  sizes_[0].set(x, y, counts ? std::sqrt(squares[0]) : 0);
  sizes_[1].set(x, y, counts ? std::sqrt(squares[1]) : 0);
  squares_.set(x, y, counts ? squares[0] + squares[1] : 0);
  counts_.set(x, y, counts ? 1 : 0);
}

double SquaredErrors::evenness(const PixelRect& window, double pixels) const {
  const double size = std::hypot(sizes_[0].sum(window), sizes_[1].sum(window)) / pixels;
  const double square = squares_.sum(window) / pixels;
  // Cauchy's inequality, but for rounding; at least as if all were on one pixel.
  return square > 0 ? std::clamp(size / std::sqrt(square), 1 / std::sqrt(pixels), 1.0)
                    : kMeanOfRoot;
}

double SquaredErrors::error(const PixelRect& window) const {
  const double pixels = counts_.sum(window);
  return pixels > 0 ? error_of(energies_.sum(window) / pixels, evenness(window, pixels)) : 0;
}

ErrorRoots SquaredErrors::roots() const {
  ErrorRoots out;
  const std::vector<PixelRect> tiles = tile_rects(rect_);
  out.tiles.resize(tiles.size());
  std::vector<Window> windows;
  double noise = 0;  // of the windows' means, weighted by their pixels, as all sums here
  double sum = 0;
  double pixels = 0;
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    const PixelRect& tile = tiles[t];
    const int right = tile.x + tile.width;
    const int bottom = tile.y + tile.height;
    for (int y = tile.y - tile.y % kEnergyWindow; y < bottom; y += kEnergyWindow) {
      for (int x = tile.x - tile.x % kEnergyWindow; x < right; x += kEnergyWindow) {
        const int x0 = std::max(x, tile.x);
        const int y0 = std::max(y, tile.y);
        const PixelRect of = {x0 - rect_.x, y0 - rect_.y, std::min(x + kEnergyWindow, right) - x0,
                              std::min(y + kEnergyWindow, bottom) - y0};
        const double count = counts_.sum(of);
        if (count > 0) {
          const double apart = chessboard_.sum(of) / count;
          noise += count * apart * apart;
          sum += energies_.sum(of);
          pixels += count;
          windows.push_back(
              {t, count, energies_.sum(of) / count, std::fabs(apart), evenness(of, count)});
        }
      }
    }
  }
  if (windows.empty()) {
    return out;
  }
  const double mean = sum / pixels;
  double spread = 0;
  for (const Window& window : windows) {
    const double apart = window.mean - mean;
    spread += window.pixels * apart * apart;
  }
  const double kept = spread > 0 ? std::max(0.0, 1 - noise / spread) : 0;
  double squares = 0;
  for (const Window& window : windows) {
    const double drawn = std::clamp(mean + kept * (window.mean - mean), window.mean - window.noise,
                                    window.mean + window.noise);
    const double error = error_of(drawn, window.evenness);
    out.tiles[window.tile] += window.pixels * error;
    // Of each window alone: less than the whole error's where noise drew the windows together.
    const double reach = window.pixels * (error_of(drawn + window.noise, window.evenness) - error);
    squares += reach * reach;
  }
  out.deviation = std::sqrt(squares) / pixels;
  return out;
}

}  // namespace core
