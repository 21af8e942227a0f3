#include "core/film/film_shape.h"

#include "core/film/film.h"
#include "core/film/tile_planes.h"

namespace core {
namespace {

std::size_t area(const PixelRect& r) {
  return static_cast<std::size_t>(r.width) * static_cast<std::size_t>(r.height);
}

/// Returns the tiles of the full film: those that overlap the crop first, then the others.
std::vector<PixelRect> units_of(const FilmSettings& settings, const std::vector<PixelRect>& tiles) {
  const std::vector<PixelRect> all = tile_rects({0, 0, settings.width, settings.height});
  const int columns = (settings.width + kTileSize - 1) / kTileSize;
  std::vector<bool> is_taken(all.size());
  std::vector<PixelRect> units;
  units.reserve(all.size());
  for (const PixelRect& tile : tiles) {
    const auto i = static_cast<std::size_t>(tile.y / kTileSize * columns + tile.x / kTileSize);
    units.push_back(all[i]);
    is_taken[i] = true;
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!is_taken[i]) {
      units.push_back(all[i]);
    }
  }
  return units;
}

}  // namespace

std::vector<PixelRect> tile_rects(PixelRect crop) {
  std::vector<PixelRect> rects;
  const int x1 = crop.x + crop.width;
  const int y1 = crop.y + crop.height;
  for (int y = crop.y - crop.y % kTileSize; y < y1; y += kTileSize) {
    for (int x = crop.x - crop.x % kTileSize; x < x1; x += kTileSize) {
      const int left = std::max(x, crop.x);
      const int top = std::max(y, crop.y);
      rects.push_back(
          {left, top, std::min(x + kTileSize, x1) - left, std::min(y + kTileSize, y1) - top});
    }
  }
  return rects;
}

FilmShape::FilmShape(const FilmSettings& settings, int replicates, PixelErrors errors,
                     bool has_splats)
    : crop_(settings.area()),
      full_width_(settings.width),
      full_height_(settings.height),
      replicates_(replicates),
      recorded_(parts_asked_for(settings)),
      has_splats_(has_splats),
      shares_(settings.shares),
      errors_(errors),
      over_white_(settings.errors_over_white),
      rects_(core::tile_rects(crop_)),
      unit_rects_(has_splats ? units_of(settings, rects_) : rects_) {}

FilmShape::FilmShape(const RenderSettings& settings, PixelErrors errors, bool has_splats)
    : FilmShape(settings.film, settings.replicates, errors, has_splats) {
  adaptive_ = settings.adaptive.type;
  fit_ = fit_type(settings);
  meter_points_ = settings.meter.count();
  meter_chunk_count_ = static_cast<int>(meter_chunks(meter_points_));
}

std::size_t FilmShape::bytes() const noexcept {
  const std::size_t splat_bytes = has_splats() ? static_cast<std::size_t>(replicates_) *
                                                     (1 + shares_.size()) * sizeof(SplatPixel)
                                               : 0;
  const auto of_value = [](const auto& plane) { return value_bytes(plane); };
  return area(crop_) * (pixel_bytes(shape_of(*this), of_value) + splat_bytes) +
         rects_.size() * (sizeof(Film::Slot) + sizeof(PixelRect)) +
         meter_points_ * kMeterReplicates * sizeof(MeterSum);
}

}  // namespace core
