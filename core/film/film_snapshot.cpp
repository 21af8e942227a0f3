#include <algorithm>
#include <array>

#include "core/film/tile_planes.h"
#include "core/math/numbers.h"

namespace core {
namespace {

/// The pixels of a row that a tile and a snapshot share.
struct Run {
  std::size_t from = 0;  ///< index in the tile
  std::size_t to = 0;    ///< index in the snapshot
  std::size_t count = 0;
};

bool meet(const PixelRect& a, const PixelRect& b) {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

template <typename F>
void for_each_run(const PixelRect& tile, const PixelRect& rect, const F& f) {
  const int x0 = std::max(tile.x, rect.x);
  const int x1 = std::min(tile.x + tile.width, rect.x + rect.width);
  const int y0 = std::max(tile.y, rect.y);
  const int y1 = std::min(tile.y + tile.height, rect.y + rect.height);
  const auto at = [](const PixelRect& r, int x, int y) {
    return static_cast<std::size_t>(y - r.y) * static_cast<std::size_t>(r.width) +
           static_cast<std::size_t>(x - r.x);
  };
  for (int y = y0; y < y1 && x0 < x1; ++y) {
    f(Run{at(tile, x0, y), at(rect, x0, y), static_cast<std::size_t>(x1 - x0)});
  }
}

/// Copies `per_pixel` values of each pixel from `from` to `to`.
template <typename T>
void copy_run(const std::vector<T>& from, std::vector<T>& to, const Run& run,
              std::size_t per_pixel) {
  if (!to.empty() && per_pixel > 0) {
    std::copy_n(&from[run.from * per_pixel], run.count * per_pixel, &to[run.to * per_pixel]);
  }
}

void copy_tiles(const std::vector<std::shared_ptr<const TileState>>& states, const TileShape& shape,
                FilmSnapshot& out) {
  for (const auto& state : states) {
    if (state->pixels.empty()) {
      continue;
    }
    for_each_run(state->rect, out.rect, [&](const Run& run) {
      for_each_kept_plane([&](const auto& plane) {
        copy_run((*state).*plane.values, out.*plane.in_snapshot, run, plane.per_pixel(shape));
      });
    });
  }
}

}  // namespace

void Film::add_folded_splats(std::size_t tile, FilmSnapshot& out) const {
  const std::vector<SplatPixel>& splats = splats_.tiles[tile];
  if (splats.empty() || tiles_[tile].state->pixels.empty()) {
    return;
  }
  const auto r = static_cast<std::size_t>(replicates());
  const std::size_t shares = this->shares().size();
  const std::size_t plane = tiles_[tile].state->pixels.size();
  for_each_run(tile_rects()[tile], out.rect, [&](const Run& run) {
    for (std::size_t i = 0; i < run.count * r; ++i) {
      const std::size_t from = run.from * r + i;
      ReplicatePixel& pixel = out.pixels[run.to * r + i];
      fold_splats(pixel, splats[from], paths_per_pixel(i % r));
      for (std::size_t k = 0; k < shares; ++k) {
        ReplicatePixel light;
        light.count = pixel.count;
        fold_splats(light, splats[(k + 1) * plane + from], paths_per_pixel(i % r));
        out.shares[(run.to * r + i) * shares + k] += {light.mean_r, light.mean_g, light.mean_b};
      }
    }
  });
}

FilmSnapshot Film::snapshot(PixelRect rect, Planes planes) const {
  FilmSnapshot out;
  out.rect = rect;
  const std::size_t pixels = out.pixel_count();
  out.replicates = replicates();
  out.recorded = planes == Planes::kAll ? recorded() : RecordedParts();
  out.has_splats = has_splats();
  out.errors = errors();
  out.errors_over_white = errors_over_white();
  TileShape shape = shape_of(*this);
  shape.recorded = out.recorded;
  for_each_kept_plane(
      [&](const auto& plane) { (out.*plane.in_snapshot).resize(pixels * plane.per_pixel(shape)); });
  for (const LightShare& share : shares()) {
    out.share_layers.push_back(share.layer);
  }
  std::vector<std::shared_ptr<const TileState>> states;
  {
    MutexLock lock(mutex_);
    out.revision = revision_;
    for (std::size_t tile = 0; tile < tiles_.size(); ++tile) {
      if (meet(tile_rects()[tile], rect)) {
        states.push_back(tiles_[tile].state);
      }
    }
    if (has_splats()) {  // sums of the whole film change with every commit
      copy_tiles(states, shape, out);
      for (std::size_t tile = 0; tile < tiles_.size(); ++tile) {
        add_folded_splats(tile, out);
      }
      return out;
    }
  }
  copy_tiles(states, shape, out);
  return out;
}

std::array<HalfValue, 2> error_halves(const FilmSnapshot& film, std::size_t pixel) {
  std::array<HalfValue, 2> halves = {half_value(film, pixel, 0), half_value(film, pixel, 1)};
  if (film.errors_over_white) {
    put_over_white(halves[0], halves[1]);
  }
  return halves;
}

SampleVariance sample_variance(const FilmSnapshot& film, std::size_t pixel) {
  const auto r = static_cast<std::size_t>(film.replicates);
  double squares = 0;
  std::array<double, 2> counts{};
  SampleVariance out;
  for (std::size_t k = 0; k < r; ++k) {
    const ReplicatePixel& p = film.pixels[pixel * r + k];
    if (p.count > 0) {
      squares += static_cast<double>(p.m2_luminance);
      counts[k % 2] += static_cast<double>(p.count);
      out.degrees += static_cast<double>(p.count) - 1;
    }
  }
  if (out.degrees > 0) {
    const double of_sample = std::max(squares, 0.0) / out.degrees;
    const bool has_both = counts[0] > 0 && counts[1] > 0;
    out.of_mean = has_both ? 0.25 * of_sample * (1 / counts[0] + 1 / counts[1])
                           : of_sample / (counts[0] + counts[1]);
  }
  return out;
}

}  // namespace core
