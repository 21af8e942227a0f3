#include "core/render/allocation.h"

#include <algorithm>
#include <cmath>

#include "core/film/moment_sums.h"
#include "core/render/pass_plan.h"

namespace core {
namespace {

/// Share that is spread evenly.
constexpr double kEven = 0.1;
/// No pixel is given more than this many times the mean.
constexpr double kMost = 16;
/// Differences that a variance is pooled from: known to some 15 %.
constexpr double kPooled = 100;

/// Per pixel of the crop, row by row: mean and variance of one sample, three channels, and its cost.
struct Statistics {
  std::vector<Rgb> mean;
  std::vector<Rgb> variance;
  std::vector<float> cost;
  double degrees = 1;  ///< of freedom of each variance
};

/// Calls put(pixel of the tile, pixel of the crop) for every pixel of the tile.
template <typename Put>
void for_pixels(PixelRect tile, PixelRect crop, Put&& put) {
  std::size_t i = 0;
  for (int y = tile.y - crop.y; y < tile.y - crop.y + tile.height; ++y) {
    for (int x = tile.x - crop.x; x < tile.x - crop.x + tile.width; ++x, ++i) {
      put(i, static_cast<std::size_t>(y) * static_cast<std::size_t>(crop.width) + static_cast<std::size_t>(x));
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

/// From the picture's own samples, of the replicates first, first + stride, ...; luminance in all channels.
Statistics of_picture(const Film& film, int first, int stride) {
  Statistics out;
  out.mean.resize(pixels_of(film));
  out.variance.resize(pixels_of(film));
  out.cost.assign(pixels_of(film), 1.0F);
  const int r = film.replicates();
  for (int t = 0; t < film.tile_count(); ++t) {
    const TileState tile = film.tile(t);
    for_pixels(tile.rect, film.crop(), [&](std::size_t from, std::size_t to) {
      double n = 0;
      double sum = 0;
      double m2 = 0;
      double degrees = 0;
      for (int k = first; k < r; k += stride) {
        const ReplicatePixel& p = tile.pixels[from * static_cast<std::size_t>(r) + static_cast<std::size_t>(k)];
        n += p.count;
        sum += static_cast<double>(luminance({p.mean_r, p.mean_g, p.mean_b})) * p.count;
        m2 += static_cast<double>(p.m2_luminance);
        degrees += static_cast<double>(p.count) - 1;
      }
      out.degrees = std::max(degrees, 1.0);
      out.mean[to] = Rgb(static_cast<float>(sum / n));
      out.variance[to] = Rgb(static_cast<float>(m2 / out.degrees));
    });
  }
  return out;
}

/// sqrt(relative variance / cost) of each pixel, pooled.
std::vector<float> needs(const Statistics& s, int width, int height) {
  const int radius = static_cast<int>(std::ceil((std::sqrt(kPooled / s.degrees) - 1) / 2));
  MomentSums sums(width, height);
  SummedArea costs(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
      sums.set(x, y, s.mean[i], s.variance[i]);
      costs.set(x, y, static_cast<double>(s.cost[i]));
    }
  }
  std::vector<float> out;
  out.reserve(s.mean.size());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const PixelRect window = window_around(x, y, std::max(radius, 0), width, height);
      const MomentSums::Values v = sums.over(window);
      double ratio = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        ratio += std::max(v.variance[c], 0.0) / (v.mean[c] * v.mean[c] + MomentSums::kRegularizer) / 3;
      }
      const double cost = std::max(costs.sum(window) / v.count, 1.0);
      out.push_back(static_cast<float>(std::sqrt(ratio / cost)));
    }
  }
  return out;
}

/// Pixels that see lights in part have no share in what is pooled: the pixel before them stands for them.
void leave_out(const LightEdges& edges, Statistics& s) {
  for (const LightEdge& edge : edges) {
    const std::size_t from = edge.pixel > 0 ? edge.pixel - 1 : 0;
    s.mean[edge.pixel] = s.mean[from];
    s.variance[edge.pixel] = s.variance[from];
  }
}

/// Adds what light's rims need. s: what leave_out() left. samples: that pixels have, about.
void add_edges(const LightEdges& edges, const Statistics& s, int samples, std::vector<float>& need) {
  for (const LightEdge& edge : edges) {
    const std::size_t i = edge.pixel;
    const float mean = luminance(edge.mean) + (1 - edge.coverage) * luminance(s.mean[i]);
    // Well-spread samples of an edge in the plane have sqrt(met) less variance than independent ones, where `met` of them meet the lesser side.
    const float met = static_cast<float>(samples) * std::min(edge.coverage, 1 - edge.coverage);
    const float ratio = edge.variance / std::sqrt(1 + met) / (mean * mean + static_cast<float>(MomentSums::kRegularizer));
    need[i] = std::sqrt(need[i] * need[i] + ratio / std::max(s.cost[i], 1.0F));
  }
}

/// The largest within `radius`, along rows or columns.
std::vector<float> largest_along(const std::vector<float>& values, int width, int height, int radius, bool rows) {
  std::vector<float> out(values.size());
  const int length = rows ? width : height;
  const int lines = rows ? height : width;
  for (int line = 0; line < lines; ++line) {
    const auto at = [&](int i) {
      const int x = rows ? i : line;
      const int y = rows ? line : i;
      return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
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
  return largest_along(largest_along(values, width, height, radius, true), width, height, radius, false);
}

/// Every pixel of a tile gets the root mean square of the tile: needs squared are variances, which add up.
std::vector<float> by_tile(const std::vector<float>& values, const Film& film, int radius) {
  const PixelRect crop = film.crop();
  std::vector<float> tiles;
  int columns = 0;
  for (int t = 0; t < film.tile_count(); ++t) {
    const PixelRect rect = film.tile_rect(t);
    columns += rect.y == film.tile_rect(0).y ? 1 : 0;
    double sum = 0;
    for_pixels(rect, crop, [&](std::size_t, std::size_t i) { sum += static_cast<double>(values[i]) * static_cast<double>(values[i]); });
    tiles.push_back(static_cast<float>(std::sqrt(sum / (static_cast<double>(rect.width) * rect.height))));
  }
  tiles = dilated(std::move(tiles), columns, film.tile_count() / columns, radius);
  std::vector<float> out(values.size());
  for (int t = 0; t < film.tile_count(); ++t) {
    for_pixels(film.tile_rect(t), crop, [&](std::size_t, std::size_t i) { out[i] = tiles[static_cast<std::size_t>(t)]; });
  }
  return out;
}

std::vector<float> needs_of(const Film& film, const AdaptiveSettings& settings, Statistics statistics, const LightEdges& edges,
                            int samples) {
  const PixelRect crop = film.crop();
  leave_out(edges, statistics);
  std::vector<float> need = needs(statistics, crop.width, crop.height);
  if (settings.granularity == Granularity::kTile) {
    add_edges(edges, statistics, samples, need);
    return by_tile(need, film, settings.dilation);
  }
  need = dilated(std::move(need), crop.width, crop.height, settings.dilation);
  add_edges(edges, statistics, samples, need);  // they are known to the pixel
  return need;
}

/// Where each pixel of the crop is when the epoch begins, one half.
std::vector<std::uint32_t> counts_at(const Film& film, std::size_t half, int from) {
  std::vector<std::uint32_t> out(pixels_of(film));
  for (int t = 0; t < film.tile_count(); ++t) {
    const TileState tile = film.tile(t);
    for_pixels(tile.rect, film.crop(), [&](std::size_t i, std::size_t to) {
      out[to] = tile.plan.empty()
                    ? static_cast<std::uint32_t>(uniform_count(from, film.replicates(), static_cast<int>(half)))
                    : tile.plan[i].to[half];
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
      weight[i] = std::min(kEven + (1 - kEven) * static_cast<double>(budget.need[i]) / mean_need, kMost);
    }
  }
  // Counts are scale * weight, and `has` where that is more: once there, a pixel stays there, because the scale only falls.
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
  // Whole steps; what is cut off here is given to the next pixel.
  std::vector<std::uint32_t> out(n);
  double carried = 0.5;
  for (std::size_t i = 0; i < n; ++i) {
    const double more = full[i] != 0 ? 0 : (scale * weight[i] - static_cast<double>(budget.has[i])) / budget.step;
    const double whole = std::floor(std::max(more + carried, 0.0));
    carried += more - whole;
    out[i] = budget.has[i] + budget.step * static_cast<std::uint32_t>(whole);
  }
  return out;
}

std::vector<std::vector<PixelPlan>> make_plans(const Film& film, const RenderSettings& render, int from,
                                              const LightEdges& edges) {
  const AdaptiveSettings& settings = render.adaptive;
  const PixelRect crop = film.crop();
  const bool crossed = settings.type == AdaptiveType::kCrossHalf;
  const bool goes_on = crossed && film.tile(0).span.to > 0;
  std::array<std::vector<std::uint32_t>, 2> begin;
  std::array<std::vector<std::uint32_t>, 2> end;
  for (const std::size_t half : {std::size_t{0}, std::size_t{1}}) {
    begin[half] = counts_at(film, half, from);
    if (goes_on) {
      continue;
    }
    if (half == 1 && !crossed) {  // both halves of a pixel get the same
      end[1] = end[0];
      continue;
    }
    const Statistics statistics = settings.type == AdaptiveType::kPilot ? of_pilot(film)
                                  : crossed ? of_picture(film, static_cast<int>(1 - half), 2)
                                            : of_picture(film, 0, 1);
    Budget budget;
    budget.width = crop.width;
    budget.height = crop.height;
    budget.need = needs_of(film, settings, statistics, edges, epoch_end(from));
    budget.has = begin[half];
    budget.mean = 0.5 * epoch_end(from);
    budget.step = static_cast<std::uint32_t>(plan_step(render));
    if (crossed) {  // in proportion from here on, for good
      std::fill(budget.has.begin(), budget.has.end(), 0U);
      budget.mean = 0.5 * (epoch_end(from) - from);
    }
    end[half] = distribute(budget);
    for (std::size_t i = 0; crossed && i < end[half].size(); ++i) {
      end[half][i] += begin[half][i];
    }
  }
  std::vector<std::vector<PixelPlan>> plans(static_cast<std::size_t>(film.tile_count()));
  for (int t = 0; t < film.tile_count(); ++t) {
    const TileState tile = film.tile(t);
    auto& plan = plans[static_cast<std::size_t>(t)];
    plan.resize(static_cast<std::size_t>(tile.rect.width) * static_cast<std::size_t>(tile.rect.height));
    for_pixels(tile.rect, crop, [&](std::size_t i, std::size_t pixel) {
      for (const std::size_t half : {std::size_t{0}, std::size_t{1}}) {
        const std::uint32_t at = begin[half][pixel];
        plan[i].from[half] = at;
        // The epoch before was half as long.
        plan[i].to[half] = goes_on ? at + 2 * (at - tile.plan[i].from[half]) : end[half][pixel];
      }
    });
  }
  return plans;
}

}  // namespace core
