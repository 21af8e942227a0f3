#include "core/error/pixel_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/base/statistics.h"
#include "core/error/error_estimate.h"
#include "core/film/summed_area.h"

namespace core {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// 97.5% quantiles of Student's t, by the number of pixels of a window.
const auto& quantiles() {
  constexpr int kSide = 2 * kErrorWindow + 1;
  static const auto kTable = [] {
    std::array<float, kSide * kSide + 1> table{};
    for (std::size_t count = 1; count < table.size(); ++count) {
      table[count] = static_cast<float>(student_t_quantile(0.975, static_cast<double>(count)));
    }
    return table;
  }();
  return kTable;
}

bool has_halves(const HalfValue& a, const HalfValue& b) { return a.count > 0 && b.count > 0; }

}  // namespace

PixelError pixel_error(const FilmSnapshot& film, int x, int y) {
  const PixelRect& rect = film.rect;
  const PixelRect window =
      window_around(x - rect.x, y - rect.y, kErrorWindow, rect.width, rect.height);
  const auto index = [&](int column, int row) {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(rect.width) +
           static_cast<std::size_t>(column);
  };
  std::array<double, 3> squares{};  // Squares of 1e20 and more overflow float.
  int count = 0;
  for (int row = window.y; row < window.y + window.height; ++row) {
    for (int column = window.x; column < window.x + window.width; ++column) {
      const auto [a, b] = error_halves(film, index(column, row));
      if (has_halves(a, b)) {
        for (int c = 0; c < 3; ++c) {
          const double d = static_cast<double>(a.mean[c]) - static_cast<double>(b.mean[c]);
          squares[static_cast<std::size_t>(c)] += 0.25 * d * d;
        }
        ++count;
      }
    }
  }
  const std::size_t own = index(x - rect.x, y - rect.y);
  PixelError out;
  if (!has_halves(half_value(film, own, 0), half_value(film, own, 1))) {
    out.standard_error = out.low = out.high = Rgb(kNan);
    return out;
  }
  const auto root = [&](std::size_t c) {
    return static_cast<float>(std::sqrt(squares[c] / count));
  };
  out.standard_error = {root(0), root(1), root(2)};
  const float quantile = quantiles()[static_cast<std::size_t>(count)];
  const Rgb mean = pixel_value(film, own).mean;
  out.low = mean - out.standard_error * quantile;
  out.high = mean + out.standard_error * quantile;
  return out;
}

Rgb raw_variance(const HalfValue& a, const HalfValue& b) {
  if (!has_halves(a, b)) {
    return Rgb(kNan);
  }
  // The square of a value above about 1e19 overflows a float: use the largest float instead.
  const auto squared_half = [](float d) {
    return std::min(0.25F * d * d, std::numeric_limits<float>::max());
  };
  const Rgb d = a.mean - b.mean;
  return {squared_half(d.r), squared_half(d.g), squared_half(d.b)};
}

void FloorSum::add(const FilmSnapshot& film) {
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    const auto [a, b] = error_halves(film, i);
    if (!is_empty(a, b)) {
      roots_ += root_of_light(pixel_value(a, b).mean);
      pixels_ += 1;
    }
  }
}

double floor_of(const FilmSnapshot& film) {
  if (film.error_floor) {
    return *film.error_floor;
  }
  FloorSum sum;
  sum.add(film);
  return sum.floor();
}

std::vector<TileSums> half_sums(const FilmSnapshot& film) {
  std::vector<TileSums> out;
  const double floor = floor_of(film);
  const auto r = static_cast<std::size_t>(film.replicates);
  for (const PixelRect& tile : tile_rects(film.rect)) {
    std::vector<ReplicatePixel> pixels;
    for (int y = tile.y - film.rect.y; y < tile.y - film.rect.y + tile.height; ++y) {
      const auto first = (static_cast<std::size_t>(y) * static_cast<std::size_t>(film.rect.width) +
                          static_cast<std::size_t>(tile.x - film.rect.x)) *
                         r;
      const auto begin = film.pixels.begin() + static_cast<std::ptrdiff_t>(first);
      pixels.insert(pixels.end(), begin,
                    begin + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(tile.width) * r));
    }
    out.push_back(half_sums(tile, pixels, film.replicates, floor, film.errors_over_white));
  }
  return out;
}

std::vector<float> relative_error_plane(const FilmSnapshot& film) {
  const double floor = floor_of(film);
  const int width = film.rect.width;
  const int height = film.rect.height;
  SummedArea shares(width, height);
  SummedArea doubtful(width, height);
  SummedArea scales(width, height);
  SummedArea counts(width, height);
  std::vector<float> out(film.pixel_count());
  std::size_t i = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, ++i) {
      const auto [a, b] = error_halves(film, i);
      const bool known = has_halves(a, b);
      out[i] = known ? 0 : kNan;
      const PixelShare share =
          known && !is_empty(a, b) ? share_of_pixel(a, b, floor) : PixelShare{};
      shares.set(x, y, share.share);
      doubtful.set(x, y, share.apart * share.share);
      scales.set(x, y, share.scale);
      counts.set(x, y, share.scale > 0 ? 1 : 0);
    }
  }
  i = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, ++i) {
      const PixelRect window = window_around(x, y, kErrorWindow, width, height);
      const double scale = scales.sum(window);
      const double count = counts.sum(window);
      if (!std::isnan(out[i]) && scale > 0 && count > 0) {
        const double error = std::max(shares.sum(window), 0.0) / count +
                             0.5 * std::max(doubtful.sum(window), 0.0) / scale;
        out[i] = static_cast<float>(std::min(error, 1.0));
      }
    }
  }
  return out;
}

}  // namespace core
