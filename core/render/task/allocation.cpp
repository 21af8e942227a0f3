#include "core/render/task/allocation.h"

#include <algorithm>
#include <cmath>

#include "core/film/half_sums.h"
#include "core/film/summed_area.h"
#include "core/render/task/pass_plan.h"

namespace core {
namespace {

/// Fraction that is spread evenly.
constexpr double kEven = 0.1;
/// Maximum count of a pixel, as a multiple of the mean.
constexpr double kMost = 16;
/// Number of differences that a variance is pooled from: it is then known to about 15%.
constexpr double kPooled = 100;

/// Per pixel of the crop, row by row: mean and variance of one sample in three channels, and its
/// cost.
struct Statistics {
  std::vector<Rgb> mean;
  std::vector<Rgb> variance;
  std::vector<float> cost;
  double degrees = 1;  ///< degrees of freedom of each variance
};

/// Calls put(pixel of the tile, pixel of the crop) for every pixel of the tile.
template <typename Put>
void for_pixels(PixelRect tile, PixelRect crop, Put&& put) {
  std::size_t i = 0;
  for (int y = tile.y - crop.y; y < tile.y - crop.y + tile.height; ++y) {
    for (int x = tile.x - crop.x; x < tile.x - crop.x + tile.width; ++x, ++i) {
      put(i, static_cast<std::size_t>(y) * static_cast<std::size_t>(crop.width) +
                 static_cast<std::size_t>(x));
    }
  }
}

std::size_t pixels_of(const Film& film) {
  return static_cast<std::size_t>(film.crop().width) * static_cast<std::size_t>(film.crop().height);
}

Statistics of_pilot(const Film& film) {
  Statistics out;
  out.mean.resize(pixels_of(film));
  out.variance.resize(pixels_of(film));
  out.cost.resize(pixels_of(film));
  for (int t = 0; t < film.tile_count(); ++t) {
    const TileState tile = film.tile(t);
    for_pixels(tile.rect, film.crop(), [&](std::size_t from, std::size_t to) {
      const PilotPixel& p = tile.pilot[from];
      out.degrees = static_cast<double>(p.count) - 1;
      out.mean[to] = p.mean;
      out.variance[to] = p.m2 * (1 / static_cast<float>(p.count - 1));
      out.cost[to] = p.rays + 1;  // the camera path itself
    });
  }
  return out;
}

/// Returns (s / (l + 3 F) / cost)^(2/3) of each pixel: s standard deviation, l light, F the floor,
/// all but F pooled over neighbours. The grain (core/error/error_estimate.h) is the mean of s / (l
/// + 3 F) / sqrt(n), which is least for a given sum of n cost if n is proportional to this.
std::vector<float> needs(const Statistics& s, int width, int height) {
  const int radius =
      std::max(static_cast<int>(std::ceil((std::sqrt(kPooled / s.degrees) - 1) / 2)), 0);
  SummedArea variances(width, height);
  SummedArea lights(width, height);
  SummedArea costs(width, height);
  double roots = 0;
  const auto sum = [](Rgb c) { return static_cast<double>(c.r + c.g + c.b); };
  std::size_t i = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, ++i) {
      variances.set(x, y, sum(s.variance[i]));
      lights.set(x, y, std::abs(sum(s.mean[i])));
      costs.set(x, y, static_cast<double>(s.cost[i]));
      roots += root_of_light(s.mean[i]);
    }
  }
  const double floor = 3 * error_floor(roots / static_cast<double>(s.mean.size()));
  const auto mean_over = [](const SummedArea& area, const PixelRect& r) {
    return area.sum(r) / (static_cast<double>(r.width) * r.height);
  };
  std::vector<float> out;
  out.reserve(s.mean.size());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const PixelRect window = window_around(x, y, radius, width, height);
      const double variance = std::max(mean_over(variances, window), 0.0);
      const double scale = std::max(mean_over(lights, window), 0.0) + floor;
      const double cost = std::max(mean_over(costs, window), 1.0);
      const double need = variance > 0 ? std::sqrt(variance) / scale / cost : 0;
      out.push_back(static_cast<float>(std::cbrt(need * need)));
    }
  }
  return out;
}

/// Returns the maximum within `radius`, along rows or columns.
std::vector<float> largest_along(const std::vector<float>& values, int width, int height,
                                 int radius, bool rows) {
  std::vector<float> out(values.size());
  const int length = rows ? width : height;
  const int lines = rows ? height : width;
  for (int line = 0; line < lines; ++line) {
    const auto at = [&](int i) {
      const int x = rows ? i : line;
      const int y = rows ? line : i;
      return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
             static_cast<std::size_t>(x);
    };
    for (int i = 0; i < length; ++i) {
      float most = 0;
      for (int k = std::max(i - radius, 0); k <= std::min(i + radius, length - 1); ++k) {
        most = std::max(most, values[at(k)]);
      }
      out[at(i)] = most;
    }
  }
  return out;
}

std::vector<float> dilated(std::vector<float> values, int width, int height, int radius) {
  if (radius == 0) {
    return values;
  }
  return largest_along(largest_along(values, width, height, radius, true), width, height, radius,
                       false);
}

/// Gives every pixel of a tile the same need, from the mean of their (needs)^(3/2), which add up.
std::vector<float> by_tile(const std::vector<float>& values, const Film& film, int radius) {
  const PixelRect crop = film.crop();
  std::vector<float> tiles;
  int columns = 0;
  for (int t = 0; t < film.tile_count(); ++t) {
    const PixelRect rect = film.tile_rect(t);
    columns += rect.y == film.tile_rect(0).y ? 1 : 0;
    double sum = 0;
    for_pixels(rect, crop, [&](std::size_t, std::size_t i) {
      sum += std::pow(static_cast<double>(values[i]), 1.5);
    });
    tiles.push_back(static_cast<float>(
        std::pow(sum / (static_cast<double>(rect.width) * rect.height), 2.0 / 3)));
  }
  tiles = dilated(std::move(tiles), columns, film.tile_count() / columns, radius);
  std::vector<float> out(values.size());
  for (int t = 0; t < film.tile_count(); ++t) {
    for_pixels(film.tile_rect(t), crop,
               [&](std::size_t, std::size_t i) { out[i] = tiles[static_cast<std::size_t>(t)]; });
  }
  return out;
}

std::vector<float> needs_of(const Film& film, const AdaptiveSettings& settings) {
  const PixelRect crop = film.crop();
  std::vector<float> need = needs(of_pilot(film), crop.width, crop.height);
  return settings.granularity == Granularity::kTile
             ? by_tile(need, film, settings.dilation)
             : dilated(std::move(need), crop.width, crop.height, settings.dilation);
}

/// Returns the samples of each half of a pixel of the crop at the start of the epoch.
std::vector<std::uint32_t> counts_at(const Film& film, int from) {
  std::vector<std::uint32_t> out(pixels_of(film));
  for (int t = 0; t < film.tile_count(); ++t) {
    const TileState tile = film.tile(t);
    for_pixels(tile.rect, film.crop(), [&](std::size_t i, std::size_t to) {
      out[to] = tile.plan.empty()
                    ? static_cast<std::uint32_t>(uniform_count(from, film.replicates(), 0))
                    : tile.plan[i].to;
    });
  }
  return out;
}

}  // namespace

std::vector<std::uint32_t> distribute(const Budget& budget) {
  const std::size_t n = budget.need.size();
  double mean_need = 0;
  for (const float need : budget.need) {
    mean_need += static_cast<double>(need) / static_cast<double>(n);
  }
  std::vector<double> weight(n, 1.0);
  if (mean_need > 0) {
    for (std::size_t i = 0; i < n; ++i) {
      weight[i] =
          std::min(kEven + (1 - kEven) * static_cast<double>(budget.need[i]) / mean_need, kMost);
    }
  }
  // Counts are scale * weight, or `has` where that is larger; such pixels stay at `has`, because
  // the scale only decreases.
  std::vector<char> full(n, 0);
  double scale = 0;
  for (bool changed = true; changed;) {
    double left = budget.mean * static_cast<double>(n);
    double weights = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (full[i] != 0) {
        left -= budget.has[i];
      } else {
        weights += weight[i];
      }
    }
    scale = weights > 0 ? std::max(left, 0.0) / weights : 0;
    changed = false;
    for (std::size_t i = 0; i < n; ++i) {
      if (full[i] == 0 && scale * weight[i] < static_cast<double>(budget.has[i])) {
        full[i] = 1;
        changed = true;
      }
    }
  }
  // Counts are whole steps; the remainder is carried to the next pixel.
  std::vector<std::uint32_t> out(n);
  double carried = 0.5;
  for (std::size_t i = 0; i < n; ++i) {
    const double more =
        full[i] != 0 ? 0 : (scale * weight[i] - static_cast<double>(budget.has[i])) / budget.step;
    const double whole = std::floor(std::max(more + carried, 0.0));
    carried += more - whole;
    out[i] = budget.has[i] + budget.step * static_cast<std::uint32_t>(whole);
  }
  return out;
}

std::vector<std::vector<PixelPlan>> make_plans(const Film& film, const RenderSettings& render,
                                               int from) {
  Budget budget;
  budget.need = needs_of(film, render.adaptive);
  budget.has = counts_at(film, from);
  budget.mean = 0.5 * epoch_end(from);
  budget.step = static_cast<std::uint32_t>(plan_step(render));
  const std::vector<std::uint32_t> end = distribute(budget);
  std::vector<std::vector<PixelPlan>> plans(static_cast<std::size_t>(film.tile_count()));
  for (int t = 0; t < film.tile_count(); ++t) {
    const PixelRect rect = film.tile_rect(t);
    auto& plan = plans[static_cast<std::size_t>(t)];
    plan.resize(static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height));
    for_pixels(rect, film.crop(), [&](std::size_t i, std::size_t pixel) {
      plan[i] = {budget.has[pixel], end[pixel]};
    });
  }
  return plans;
}

}  // namespace core
