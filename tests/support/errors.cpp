#include "tests/support/errors.h"

#include <algorithm>
#include <cmath>

#include "tests/support/statistics.h"

namespace test_support {
namespace {

struct Ratio {
  double pixels = 0;
  double value = 0;
};

std::vector<Ratio> ratios_of(const std::vector<PixelTruth>& pixels, int width, int height) {
  double light = 0;
  double opaque = 0;
  for (const PixelTruth& p : pixels) {
    light += p.is_opaque ? p.luminance : 0;
    opaque += p.is_opaque ? 1 : 0;
  }
  const double floor = opaque > 0 ? 3 * std::pow(0.05 * light / opaque, 2) : 0;
  std::vector<Ratio> out;
  for (int top = 0; top < height; top += 32) {
    for (int left = 0; left < width; left += 32) {
      double noise = 0;
      double signal = 0;
      Ratio tile;
      for (int y = top; y < std::min(top + 32, height); ++y) {
        for (int x = left; x < std::min(left + 32, width); ++x) {
          const PixelTruth& p = pixels[static_cast<std::size_t>(y * width + x)];
          for (int c = 0; c < 3; ++c) {
            noise += static_cast<double>(p.noise[c]);
            signal += static_cast<double>(p.signal[c]);
          }
          tile.pixels += p.is_opaque ? 1 : 0;
        }
      }
      tile.value = noise > 0 ? noise / (std::max(signal, 0.0) + floor * tile.pixels) : 0;
      out.push_back(tile);
    }
  }
  return out;
}

}  // namespace

double defined_error(const std::vector<PixelTruth>& pixels, int width, int height) {
  double sum = 0;
  double count = 0;
  for (const Ratio& tile : ratios_of(pixels, width, height)) {
    sum += tile.pixels * tile.value;
    count += tile.pixels;
  }
  return std::sqrt(std::max(sum / count, 0.0));
}

std::vector<double> defined_tile_errors(const std::vector<PixelTruth>& pixels, int width,
                                        int height) {
  std::vector<double> out;
  for (const Ratio& tile : ratios_of(pixels, width, height)) {
    out.push_back(std::sqrt(std::max(tile.value, 0.0)));
  }
  return out;
}

std::vector<PixelTruth> truth_of(const std::vector<core::FilmSnapshot>& films) {
  const auto renders = static_cast<float>(films.size());
  std::vector<PixelTruth> out(films.front().pixel_count());
  for (std::size_t p = 0; p < out.size(); ++p) {
    Moments channels[3];
    float alpha = 0;
    for (const core::FilmSnapshot& film : films) {
      const core::HalfValue value = core::pixel_value(film, p);
      for (int c = 0; c < 3; ++c) {
        channels[c].add(static_cast<double>(value.mean[c]));
      }
      alpha += value.alpha;
    }
    const auto rgb = [&](auto&& of) {
      return core::Rgb(static_cast<float>(of(channels[0])), static_cast<float>(of(channels[1])),
                       static_cast<float>(of(channels[2])));
    };
    const core::Rgb mean = rgb([](const Moments& m) { return m.mean; });
    out[p].noise = rgb([](const Moments& m) { return m.variance(); });
    out[p].signal = mean * mean - out[p].noise / renders;  // unbiased
    out[p].luminance = static_cast<double>(luminance(mean));
    out[p].is_opaque = alpha > 0;
  }
  return out;
}

std::vector<PixelTruth> truth_of(const core::FilmSnapshot& seen,
                                 const core::FilmSnapshot& reference) {
  std::vector<PixelTruth> out(reference.pixel_count());
  for (std::size_t p = 0; p < out.size(); ++p) {
    const core::Rgb a = core::half_value(reference, p, 0).mean;
    const core::Rgb b = core::half_value(reference, p, 1).mean;
    const core::HalfValue truth = core::pixel_value(reference, p);
    const core::Rgb off = core::pixel_value(seen, p).mean - truth.mean;
    out[p].noise = off * off - (a - b) * (a - b) * 0.25F;
    out[p].signal = a * b;
    out[p].luminance = static_cast<double>(luminance(truth.mean));
    out[p].is_opaque = truth.alpha > 0;
  }
  return out;
}

std::vector<core::TileSums> tile_sums(const core::FilmSnapshot& film) {
  const auto r = static_cast<std::size_t>(film.replicates);
  std::vector<core::TileSums> out;
  for (const core::PixelRect& tile : core::tile_rects(film.rect)) {
    std::vector<core::ReplicatePixel> pixels;
    for (int y = tile.y; y < tile.y + tile.height; ++y) {
      const auto at =
          (static_cast<std::size_t>(y - film.rect.y) * static_cast<std::size_t>(film.rect.width) +
           static_cast<std::size_t>(tile.x - film.rect.x)) *
          r;
      const auto begin = film.pixels.begin() + static_cast<std::ptrdiff_t>(at);
      pixels.insert(pixels.end(), begin,
                    begin + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(tile.width) * r));
    }
    out.push_back(core::half_sums(tile, pixels, film.replicates));
  }
  return out;
}

}  // namespace test_support
