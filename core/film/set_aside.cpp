#include "core/film/set_aside.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

namespace core {

SetAside& SetAside::operator+=(const SetAside& other) {
  taken += other.taken;
  light += other.light;
  return *this;
}

namespace {

/// Returns the largest of each pixel's eight neighbours, 0 beyond the image.
std::vector<float> brightest_around(const std::vector<float>& light, int width, int height) {
  const auto columns = static_cast<std::size_t>(width);
  const std::vector<float> dark(columns);
  // Of three rows, and of those above and below alone; with a dark column on either side.
  std::vector<float> three(columns + 2);
  std::vector<float> two(columns + 2);
  std::vector<float> out(light.size());
  for (int y = 0; y < height; ++y) {
    const float* row = &light[static_cast<std::size_t>(y) * columns];
    const float* above = y > 0 ? row - columns : dark.data();
    const float* below = y + 1 < height ? row + columns : dark.data();
    for (std::size_t x = 0; x < columns; ++x) {
      two[x + 1] = std::max(above[x], below[x]);
      three[x + 1] = std::max(two[x + 1], row[x]);
    }
    for (std::size_t x = 0; x < columns; ++x) {
      out[static_cast<std::size_t>(y) * columns + x] =
          std::max(two[x + 1], std::max(three[x], three[x + 2]));
    }
  }
  return out;
}

}  // namespace

CalmFactors calm_factors(const FilmSnapshot& film) {
  const std::size_t n = film.pixel_count();
  std::array<std::vector<float>, 2> light = {std::vector<float>(n), std::vector<float>(n)};
  std::vector<float> least(n);  // bounds the light of pixels that lack a half by nothing
  for (std::size_t i = 0; i < n; ++i) {
    const HalfValue a = half_value(film, i, 0);
    const HalfValue b = half_value(film, i, 1);
    light[0][i] = luminance(a.mean);
    light[1][i] = luminance(b.mean);
    least[i] = a.count > 0 && b.count > 0 ? 0 : std::numeric_limits<float>::infinity();
  }
  // Noise decides the comparisons below, so branches would be mispredicted.
  std::vector<float> brighter(n);
  for (std::size_t i = 0; i < n; ++i) {
    const float most = light[0][i] > light[1][i] ? light[0][i] : light[1][i];
    brighter[i] = most > 0 ? most : 0.0F;
  }
  const std::vector<float> around = brightest_around(brighter, film.rect.width, film.rect.height);
  CalmFactors out = {std::vector<float>(n), std::vector<float>(n)};
  for (std::size_t half = 0; half < 2; ++half) {
    for (std::size_t i = 0; i < n; ++i) {
      const float most = std::max(std::max(around[i], light[1 - half][i]), least[i]);
      const float factor = most / light[half][i];
      out[half][i] = light[half][i] > most ? factor : 1.0F;
    }
  }
  return out;
}

SetAside taken_by(const FilmSnapshot& film, const CalmFactors& factors) {
  SetAside out;
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    const HalfValue a = half_value(film, i, 0);
    const HalfValue b = half_value(film, i, 1);
    const HalfValue before = pixel_value(a, b);
    const Rgb after = pixel_value({a.mean * factors[0][i], a.alpha, a.count},
                                  {b.mean * factors[1][i], b.alpha, b.count})
                          .mean;
    out.light += static_cast<double>(luminance(before.mean));
    out.taken += static_cast<double>(luminance(before.mean - after));
  }
  return out;
}

SetAside set_aside(FilmSnapshot& film, const PixelRect& counted) {
  const CalmFactors factors = calm_factors(film);
  SetAside out;
  const auto replicates = static_cast<std::size_t>(film.replicates);
  std::size_t i = 0;
  for (int y = film.rect.y; y < film.rect.y + film.rect.height; ++y) {
    for (int x = film.rect.x; x < film.rect.x + film.rect.width; ++x, ++i) {
      const bool is_calm = factors[0][i] == 1 && factors[1][i] == 1;
      const bool is_counted = x >= counted.x && x < counted.x + counted.width && y >= counted.y &&
                              y < counted.y + counted.height;
      const Rgb before = pixel_value(film, i).mean;
      out.light += is_counted ? static_cast<double>(luminance(before)) : 0.0;
      if (is_calm) {
        continue;
      }
      for (std::size_t k = 0; k < replicates; ++k) {
        ReplicatePixel& p = film.pixels[i * replicates + k];
        const float factor = factors[k % 2][i];
        p.mean_r *= factor;
        p.mean_g *= factor;
        p.mean_b *= factor;
        p.m2_luminance *= factor * factor;
      }
      if (is_counted) {
        out.taken += static_cast<double>(luminance(before - pixel_value(film, i).mean));
      }
    }
  }
  return out;
}

TileState calm_tile(const Film& film, int tile) {
  TileState out;
  out.rect = film.tile_rect(tile);
  FilmSnapshot wide = film.snapshot(with_neighbours(out.rect, film.crop()), Film::Planes::kLight);
  set_aside(wide, out.rect);
  const auto replicates = static_cast<std::size_t>(film.replicates());
  for (int y = out.rect.y; y < out.rect.y + out.rect.height; ++y) {
    const auto first =
        (static_cast<std::size_t>(y - wide.rect.y) * static_cast<std::size_t>(wide.rect.width) +
         static_cast<std::size_t>(out.rect.x - wide.rect.x)) *
        replicates;
    const auto row = wide.pixels.begin() + static_cast<std::ptrdiff_t>(first);
    out.pixels.insert(
        out.pixels.end(), row,
        row + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(out.rect.width) * replicates));
  }
  return out;
}

PixelRect with_neighbours(const PixelRect& rect, const PixelRect& image) {
  const int x = std::max(rect.x - 1, image.x);
  const int y = std::max(rect.y - 1, image.y);
  return {x, y, std::min(rect.x + rect.width + 1, image.x + image.width) - x,
          std::min(rect.y + rect.height + 1, image.y + image.height) - y};
}

}  // namespace core
