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
  const auto quantile = static_cast<float>(student_t_quantile(0.975, count));
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

void Light::add(const FilmSnapshot& film) {
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    const auto [a, b] = error_halves(film, i);
    if (a.alpha + b.alpha > 0) {
      sum +=
          0.5 * (static_cast<double>(luminance(a.mean)) + static_cast<double>(luminance(b.mean)));
      pixels += 1;
    }
  }
}

std::vector<float> relative_error_plane(const FilmSnapshot& film) {
  Light light;
  if (!film.mean_luminance) {
    light.add(film);
  }
  const int width = film.rect.width;
  const int height = film.rect.height;
  SummedArea noise(width, height);
  SummedArea signal(width, height);
  SummedArea count(width, height);
  std::vector<float> out(film.pixel_count());
  std::size_t i = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, ++i) {
      const auto [a, b] = error_halves(film, i);
      const bool known = has_halves(a, b);
      out[i] = known ? 0 : kNan;
      const auto ya = static_cast<double>(luminance(a.mean));
      const auto yb = static_cast<double>(luminance(b.mean));
      noise.set(x, y, known ? 0.25 * (ya - yb) * (ya - yb) : 0);
      signal.set(x, y, known ? ya * yb : 0);
      count.set(x, y, known ? 1 : 0);
    }
  }
  const double floor = error_floor(film.mean_luminance.value_or(light.mean()));
  i = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, ++i) {
      const PixelRect window = window_around(x, y, kErrorWindow, width, height);
      const double squares = std::max(noise.sum(window), 0.0);
      const double scale = std::max(signal.sum(window), 0.0) + floor * count.sum(window);
      if (!std::isnan(out[i]) && squares > 0) {
        out[i] = static_cast<float>(std::sqrt(squares / scale));
      }
    }
  }
  return out;
}

}  // namespace core
